/* The parameters that the firmware runs with: one member for each row of settings.def, in its order, without padding.
 *
 * Units:   in the names.
 * Context: written before motion starts, from EEPROM (eeprom/store.h); read by the main loop everywhere. Interrupts
 *          never read them. The tests on the board write them in RAM when they have been loaded.
 * Tests:   test/host/test_settings.c
 * Source:  manual lines 684-835. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <stddef.h>
#include <stdint.h>
#include "base/flash.h"
#include "motion/command.h"

#define SETTING_MEMBER_U8(member) uint8_t member;
#define SETTING_MEMBER_U16(member) uint16_t member;
#define SETTING_MEMBER_U32(member) uint32_t member;
#define SETTING_MEMBER_PAIR_0(member) accel_code_t member[2];
#define SETTING_MEMBER_PAIR_1(member)
#define SETTING_MEMBER_MAP(member) uint8_t member[8];

typedef struct
#ifndef __AVR__
    __attribute__((packed)) /* as on the AVR, where nothing is aligned */
#endif
{
#define SETTING(letter, type, member, kind, factory, name) SETTING_MEMBER_##type(member)
#include "settings.def"
#undef SETTING
} settings_t;

/* How a row's value is called: settings.SETTING_PLACE_<type>(member). */
#define SETTING_PLACE_U8(member) member
#define SETTING_PLACE_U16(member) member
#define SETTING_PLACE_U32(member) member
#define SETTING_PLACE_PAIR_0(member) member[0]
#define SETTING_PLACE_PAIR_1(member) member[1]
#define SETTING_PLACE_MAP(member) member

#define SETTING_BYTES_U8 1
#define SETTING_BYTES_U16 2
#define SETTING_BYTES_U32 4
#define SETTING_BYTES_PAIR_0 sizeof(accel_code_t)
#define SETTING_BYTES_PAIR_1 sizeof(accel_code_t)
#define SETTING_BYTES_MAP 1 /* of one of the eight */

/* How the unit is reached, by a terminal or in the network: these bytes, the last ones. A change of them is tried first
 * (cli/trial.h). */
#define SETTINGS_PATH offsetof(settings_t, network)
#define SETTINGS_PATH_BYTES (sizeof(settings_t) - SETTINGS_PATH)

extern settings_t settings;

/* In flash. */
extern const settings_t settings_factory;

static inline void settings_to_factory(void)
{
    FLASH_COPY(&settings, &settings_factory, sizeof settings);
}

#endif
