/* One node of the network as a shared object of its own: the firmware above the serial ports, with the fakes of the host's
 * tests. Loaded n times (as n files) it is n nodes, each with its own statics.
 *
 * Units: us of the node's own clock, which goes round. Nothing happens but in run_to(). */
#ifndef BUS_NODE_H
#define BUS_NODE_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    void (*start)(uint8_t address); /* strict packets */
    /* The main loop runs up to then, in rounds of 128 us. A longer time in which nothing comes is passed over. */
    void (*run_to)(uint32_t us);
    void (*hear)(const void *bytes, size_t count);  /* from now on, at 38,400 Bd */
    const uint8_t *(*sent)(size_t *count);          /* since the last call of hear() */
    size_t (*executed)(uint32_t *counts, size_t most); /* step counts of the motions since the last call, in order */
    void (*counters)(uint16_t *good, uint16_t *wrong, uint16_t *discarded, uint16_t *resent);
    uint32_t (*clashes)(void); /* times that it began to send while something arrived */
} bus_node_t;

enum { BUS_NODE_CHARACTER_US = 260 };

extern const bus_node_t bus_node; /* the object's only export */

#endif
