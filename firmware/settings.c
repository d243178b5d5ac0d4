#include "settings.h"
#include "base/flash.h"
#include "boot.h"

/* Factory values (requirements, annex A; ihd, xclk and what later parts need follow with those parts). */
#ifndef SETTINGS_CYCLE_US
#define SETTINGS_CYCLE_US 3000
#endif
#ifndef SETTINGS_HW_BAUD
#define SETTINGS_HW_BAUD 38400
#endif
#ifndef SETTINGS_STEPS_PER_REV
#define SETTINGS_STEPS_PER_REV 200
#endif
#ifndef SETTINGS_ACCEL /* accel codes: hundredths up to 9999 */
#define SETTINGS_ACCEL 100
#endif
#ifndef SETTINGS_DECEL
#define SETTINGS_DECEL 100
#endif
#ifndef SETTINGS_LINEAR_ACCEL
#define SETTINGS_LINEAR_ACCEL 1047
#endif
#ifndef SETTINGS_LINEAR_DECEL
#define SETTINGS_LINEAR_DECEL 1047
#endif
#ifndef SETTINGS_RAMP
#define SETTINGS_RAMP 0
#endif
#ifndef SETTINGS_CW_LEVEL
#define SETTINGS_CW_LEVEL 0
#endif
#ifndef SETTINGS_DIRECTION
#define SETTINGS_DIRECTION 0
#endif
#ifndef SETTINGS_USTEP
#define SETTINGS_USTEP 0
#endif
#ifndef SETTINGS_PULSE_US
#define SETTINGS_PULSE_US 2
#endif
#ifndef SETTINGS_SLOW_RPM
#define SETTINGS_SLOW_RPM 10
#endif
#ifndef SETTINGS_DRIVER
#define SETTINGS_DRIVER 0
#endif
#ifndef SETTINGS_FULL_STEP
#define SETTINGS_FULL_STEP 1
#endif

/* Not to be taken for constants: they are written from outside (by the tests' board, and from EEPROM in time). */
#ifdef __AVR__
__attribute__((used, externally_visible))
#endif
settings_t settings = {
    .cycle_us = SETTINGS_CYCLE_US,
    .hw_baud = SETTINGS_HW_BAUD,
    .steps_per_rev = SETTINGS_STEPS_PER_REV,
    .accel = {SETTINGS_ACCEL, SETTINGS_LINEAR_ACCEL},
    .decel = {SETTINGS_DECEL, SETTINGS_LINEAR_DECEL},
    .ramp = SETTINGS_RAMP,
    .cw_level = SETTINGS_CW_LEVEL,
    .direction = SETTINGS_DIRECTION,
    .ustep = SETTINGS_USTEP,
    .pulse_us = SETTINGS_PULSE_US,
    .slow_rpm = SETTINGS_SLOW_RPM,
    .driver = SETTINGS_DRIVER,
    .driver_map = {0, 1, 2, 3, 4, 5, 6, 7},
    .full_step = SETTINGS_FULL_STEP,
};

/* Until the settings are kept in EEPROM: what .data holds in flash. */
#ifdef __AVR__
extern const uint8_t __data_load_start[];
extern uint8_t __data_start[];
void boot_restore_factory(void)
{
    FLASH_COPY(&settings, __data_load_start + ((uint8_t *)&settings - __data_start), sizeof settings);
}
#endif
