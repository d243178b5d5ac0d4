/* What is typed at the image goes into the model as well, and what the image does is compared with it (ninja_model.h).
 *
 * Errors:  a complaint of the model fails the test, with what was typed last. */
#ifndef TEST_IMAGE_NINJA_PLAY_H
#define TEST_IMAGE_NINJA_PLAY_H

#include "ninja_model.h"

extern ninja_model_t play_model;

void play_power_on(const head_options_t *head);
void play_home(void);             /* at the centre, on to where it is centred */
void play_type(const char *text); /* appended to what is being sent */
void play_run(uint64_t cycles);
void play_sent(void); /* all that was typed has arrived */
/* On until nothing is under way; false if something still is after so long. */
bool play_rests(uint64_t most);
/* The same, it must; and the platform is where the model's is. */
void play_rest(uint64_t most);

#endif
