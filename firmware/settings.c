#include "settings.h"

#define SETTING(letter, type, member, kind, factory, name) .SETTING_PLACE_##type(member) = factory,

#ifdef __AVR__
/* Filled at boot (eeprom/store.c). Not to be taken for constants: on the board the tests write them from outside. */
__attribute__((used, externally_visible)) settings_t settings;
#else
settings_t settings = {
#include "settings.def"
};
#endif

const settings_t settings_factory FLASH = {
#include "settings.def"
};
