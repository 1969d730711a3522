/* Reading a frame's body: words separated by one blank each. */
#ifndef WORDS_H
#define WORDS_H

#include <stdbool.h>
#include <stdint.h>

struct words {
    const char *next;       /* NULL after the last word */
};

/* The next word's start and length; false where there is none. */
bool words_take(struct words *w, const char **word, uint8_t *length);
/* A decimal number between low and high, no sign but `-`, no leading blank. `ok` becomes false, for
 * good, where there is none; `inside` becomes false where it lies outside. */
int32_t words_number(struct words *w, int32_t low, int32_t high, bool *ok, bool *inside);
/* Whether nothing is left. */
bool words_end(const struct words *w);
/* Whether a word is the given one. */
bool words_equal(const char *word, uint8_t length, const char *other);

#endif
