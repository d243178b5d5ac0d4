/* Decisions 0.4.2: two hundred nodes on a line that loses packets, strict: every command is executed exactly once, in order.
 *
 * Each node is the firmware itself, loaded as a shared object of its own (bus_node.h). Four masters share the line and do
 * what docs/wire-format.md says of a master. Packets are lost whole, cut off at either end, or have up to 8 wrong bits in a
 * burst, on their way to the nodes and on the way back. All nodes hear what is damaged; of what is not, the addressed one
 * and two others, and of every 500th command and of broadcasts all.
 * SAC_BUS_COMMANDS: how many commands; SAC_BUS_LOSS: of how many packets one is lost; SAC_BUS_SEED (make test-bus-long:
 * 10^6, 1,000). */
#define _GNU_SOURCE
#include "host/bus_node.h"
#include <dlfcn.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#include "crc8.h"
#include "splitmix64.h"
#include "unity.h"

enum { NODES = 200, FIRST = 10, MASTERS = 4, MOST_BYTES = 80, ATTEMPTS = 20, BROADCASTS = 3 };
enum { STX = 2, ETX = 3, ACK = 6, NAK = 0x15 };
enum { TURNAROUND_US = 3 * BUS_NODE_CHARACTER_US, ANSWER_US = 10000 }; /* docs/wire-format.md, "What a master does" */

static const bus_node_t *node[NODES];
static uint32_t now_us;

/* How a master counts. */
typedef struct {
    uint8_t origin;
    bool busy;        /* waits for an answer */
    bool one_for_all; /* one sequence for all nodes; else one for each */
    uint8_t sequence[NODES];
    uint64_t sent;           /* new packets so far */
    uint64_t spoken[NODES];  /* `sent` when the node was spoken to last */
    uint8_t broadcasts;      /* the last sequence */
} master_t;

static struct {
    uint64_t commands, refused, greetings, broadcasts, missed;       /* what was asked for */
    uint64_t packets, lost, cut, wrong, answers_lost, answers_cut, answers_wrong; /* the line's */
    uint64_t retries, repeats_due, executed;
    uint64_t good, bad_crc, discarded;         /* the nodes' own counters */
    uint64_t resent, resent_to_all;
} tally;

static double loss;
static uint64_t random_state;

static uint32_t random_u32(void)
{
    return (uint32_t)(splitmix64(&random_state) >> 32);
}

static uint32_t below(uint32_t limit)
{
    return (uint32_t)((uint64_t)random_u32() * limit >> 32);
}

void setUp(void)
{
}

void tearDown(void)
{
}

/* -- the nodes --------------------------------------------------------------------------------------------------------- */

/* The same file under another name is another object; the copies stay open, so that each has a name of its own. */
static void load_nodes(void)
{
    static char object[8 << 20];
    FILE *file = fopen(BUS_NODE_SO, "rb");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, BUS_NODE_SO);
    const size_t bytes = fread(object, 1, sizeof object, file);
    fclose(file);
    TEST_ASSERT_TRUE(bytes > 0 && bytes < sizeof object);
    for (unsigned i = 0; i < NODES; i++) {
        char path[40];
        const int copy = memfd_create("node", 0);
        TEST_ASSERT_TRUE(copy >= 0 && write(copy, object, bytes) == (ssize_t)bytes);
        snprintf(path, sizeof path, "/proc/self/fd/%d", copy);
        void *loaded = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        TEST_ASSERT_NOT_NULL_MESSAGE(loaded, dlerror());
        node[i] = dlsym(loaded, "bus_node");
        TEST_ASSERT_NOT_NULL(node[i]);
        TEST_ASSERT_TRUE(i == 0 || node[i] != node[i - 1]);
    }
}

static void start_nodes(void)
{
    for (unsigned i = 0; i < NODES; i++) {
        node[i]->start((uint8_t)(FIRST + i));
        node[i]->run_to(now_us + 50000);
    }
    now_us += 50000;
}

static void add_counters(uint64_t *repeats)
{
    for (unsigned i = 0; i < NODES; i++) {
        uint16_t good, wrong, discarded, resent;
        node[i]->counters(&good, &wrong, &discarded, &resent);
        tally.good += good;
        tally.bad_crc += wrong;
        tally.discarded += discarded;
        *repeats += resent;
    }
}

/* -- the line ---------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint8_t bytes[MOST_BYTES];
    size_t count;
} frame_t;

static frame_t make_frame(uint8_t destination, uint8_t origin, uint8_t sequence, const char *text)
{
    frame_t frame = {.bytes = {STX, destination, origin, sequence}, .count = 4};
    for (; *text != '\0'; text++) {
        frame.bytes[frame.count++] = (uint8_t)*text;
    }
    const uint8_t crc = crc8(frame.bytes + 1, frame.count - 1);
    frame.bytes[frame.count++] = ETX;
    frame.bytes[frame.count++] = crc;
    frame.bytes[frame.count++] = '\0';
    return frame;
}

/* What the line makes of it; half of what it spoils is lost whole. Whether something was done. */
static bool spoil(frame_t *frame, uint64_t *lost, uint64_t *cut, uint64_t *wrong)
{
    if (random_u32() >= loss * 4294967296.0) {
        return false;
    }
    const uint32_t how = below(4);
    if (how < 2) {
        frame->count = 0;
        ++*lost;
    } else if (how == 2) {
        const size_t gone = 1 + below((uint32_t)frame->count - 1);
        if (random_u32() & 1) {
            memmove(frame->bytes, frame->bytes + gone, frame->count - gone);
        }
        frame->count -= gone;
        ++*cut;
    } else {
        const uint32_t from = below(8 * (uint32_t)frame->count - 7);
        const uint32_t burst = random_u32() | 1;
        for (unsigned i = 0; i < 8; i++) {
            frame->bytes[(from + i) / 8] ^= (uint8_t)((burst >> i & 1) << (from + i) % 8);
        }
        ++*wrong;
    }
    return true;
}

static bool hears[NODES];

static void choose_hearers(bool all)
{
    for (unsigned i = 0; i < NODES; i++) {
        hears[i] = all;
    }
    hears[below(NODES)] = true;
    hears[below(NODES)] = true;
}

/* All of them but one hear it from now on; then it is over. */
static void put_on_the_line(const frame_t *frame, unsigned but)
{
    for (unsigned i = 0; i < NODES; i++) {
        if (hears[i] && i != but) {
            node[i]->run_to(now_us);
            node[i]->hear(frame->bytes, frame->count);
        }
    }
}

static void run_for(uint32_t us)
{
    now_us += us;
    for (unsigned i = 0; i < NODES; i++) {
        if (hears[i]) {
            node[i]->run_to(now_us);
        }
    }
}

/* A node that is not asked is silent. */
static void assert_silence(unsigned but)
{
    for (unsigned i = 0; i < NODES; i++) {
        size_t count;
        if (hears[i] && i != but) {
            (void)node[i]->sent(&count);
            TEST_ASSERT_EQUAL_UINT_MESSAGE(0, count, "a node that was not asked sends");
        }
    }
}

/* What the master has of it: 0 nothing; ACK, NAK. */
static uint8_t read_answer(const frame_t *frame, uint8_t destination, uint8_t origin, uint8_t sequence)
{
    const uint8_t *bytes = frame->bytes;
    const size_t count = frame->count;
    if (count < 8 || bytes[0] != STX || bytes[count - 3] != ETX || bytes[count - 1] != '\0' ||
        bytes[count - 2] != crc8(bytes + 1, count - 4)) {
        return 0;
    }
    if (bytes[1] != destination || bytes[2] != origin || bytes[3] != sequence) {
        return 0;
    }
    return bytes[4];
}

/* -- a master ---------------------------------------------------------------------------------------------------------- */

static uint8_t next(uint8_t sequence)
{
    return (uint8_t)((sequence + 1) | 0x80);
}

static void others_speak_to(unsigned which);

/* Sends one packet as often as it takes; returns ACK or NAK. *executions counts what the node did meanwhile. */
static uint8_t ask(master_t *master, unsigned which, uint8_t sequence, const char *text, bool all, size_t *executions,
                   uint32_t *steps)
{
    const uint8_t address = (uint8_t)(FIRST + which);
    bool done = false; /* it has come through at least once */
    *executions = 0;
    for (unsigned attempt = 0; attempt < ATTEMPTS; attempt++) {
        frame_t frame = make_frame(address, master->origin, sequence, text);
        const bool spoiled = spoil(&frame, &tally.lost, &tally.cut, &tally.wrong);
        tally.packets++;
        tally.retries += attempt > 0;
        tally.repeats_due += done && !spoiled;
        choose_hearers(all || (spoiled && frame.count != 0));
        hears[which] = true;
        put_on_the_line(&frame, NODES);
        run_for((uint32_t)frame.count * BUS_NODE_CHARACTER_US + 6 * BUS_NODE_CHARACTER_US);
        assert_silence(which);

        uint32_t counts[2];
        const size_t count = node[which]->executed(counts, 2);
        if (count != 0) {
            *steps = counts[0];
        }
        *executions += count;
        done = done || !spoiled;

        frame_t answer = {.count = 0};
        const uint8_t *sent = node[which]->sent(&answer.count);
        TEST_ASSERT_TRUE(answer.count < MOST_BYTES);
        TEST_ASSERT_EQUAL_MESSAGE(!spoiled, answer.count != 0, "an answer to what was not spoiled, and to nothing else");
        uint8_t what = 0;
        if (answer.count != 0) {
            memcpy(answer.bytes, sent, answer.count);
            const size_t its_count = answer.count;
            const bool its_spoiled = spoil(&answer, &tally.answers_lost, &tally.answers_cut, &tally.answers_wrong);
            put_on_the_line(&answer, which);
            run_for((uint32_t)its_count * BUS_NODE_CHARACTER_US);
            assert_silence(which);
            what = read_answer(&answer, master->origin, address, sequence);
            TEST_ASSERT_EQUAL_MESSAGE(!its_spoiled, what != 0, "an answer is understood unless it is spoiled");
        }
        run_for(what != 0 ? TURNAROUND_US : ANSWER_US);
        if (what != 0) {
            return what;
        }
        master->busy = true;
        others_speak_to(which);
        master->busy = false;
    }
    TEST_FAIL_MESSAGE("no answer");
    return 0;
}

static void greet(master_t *master, unsigned which, uint8_t sequence)
{
    size_t executions;
    uint32_t steps;
    (void)ask(master, which, sequence, "", false, &executions, &steps); /* an older answer, perhaps, but heard */
    TEST_ASSERT_EQUAL_UINT(0, executions);
    tally.greetings++;
}

static uint8_t next_for(master_t *master, unsigned which)
{
    uint8_t *sequence = &master->sequence[master->one_for_all ? 0 : which];
    *sequence = next(*sequence);
    master->sent++;
    return *sequence;
}

enum { NEVER_SPOKEN = 0 };

/* Each command to a node has other steps than those before. */
static void command(master_t *master, unsigned which, uint32_t steps, bool all)
{
    char text[40];
    const bool refused = below(20) == 0;
    const bool greets = master->spoken[which] == NEVER_SPOKEN ||
                        (master->one_for_all && master->sent - master->spoken[which] >= 127);
    if (greets) {
        greet(master, which, next_for(master, which));
    }
    const uint8_t sequence = next_for(master, which);
    snprintf(text, sizeof text, refused ? "m%" PRIu32 "v0" : "m%" PRIu32 "v60", steps);
    size_t executions;
    uint32_t executed = 0;
    const uint8_t answer = ask(master, which, sequence, text, all, &executions, &executed);
    master->spoken[which] = master->sent;
    tally.commands++;
    tally.refused += refused;
    tally.executed += executions;
    TEST_ASSERT_EQUAL_HEX8(refused ? NAK : ACK, answer);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(!refused, executions, "executed exactly once");
    if (!refused) {
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(steps, executed, "the command that was sent");
    }
}

static void send_to_everybody(const master_t *master, uint8_t sequence, const char *text)
{
    for (unsigned i = 0; i < BROADCASTS; i++) {
        frame_t frame = make_frame(0, master->origin, sequence, text);
        (void)spoil(&frame, &tally.lost, &tally.cut, &tally.wrong);
        tally.packets++;
        choose_hearers(true);
        put_on_the_line(&frame, NODES);
        run_for((uint32_t)frame.count * BUS_NODE_CHARACTER_US + ANSWER_US);
        assert_silence(NODES);
    }
}

/* A sequence alone to everybody, then the command, both several times; afterwards each node is greeted again. */
static void broadcast(master_t *master, uint32_t steps)
{
    char text[40];
    snprintf(text, sizeof text, "m%" PRIu32, steps);
    uint8_t *sequence = master->one_for_all ? &master->sequence[0] : &master->broadcasts;
    *sequence = next(*sequence);
    send_to_everybody(master, *sequence, "");
    *sequence = next(*sequence);
    send_to_everybody(master, *sequence, text);
    master->sent += 2;
    tally.broadcasts++;
    for (unsigned i = 0; i < NODES; i++) {
        uint32_t counts[2];
        const size_t count = node[i]->executed(counts, 2);
        TEST_ASSERT_TRUE_MESSAGE(count == 0 || (count == 1 && counts[0] == steps), "a broadcast is executed once at most");
        tally.missed += count == 0;
        if (!master->one_for_all) {
            master->spoken[i] = NEVER_SPOKEN;
        }
    }
}

static master_t masters[MASTERS];
static uint32_t last_steps;

static void others_speak_to(unsigned which)
{
    for (unsigned i = 0; i < MASTERS; i++) {
        if (!masters[i].busy && (random_u32() & 1)) {
            command(&masters[i], which, ++last_steps, false);
        }
    }
}

static void run(uint64_t commands)
{
    memset(masters, 0, sizeof masters);
    memset(&tally, 0, sizeof tally);
    for (unsigned i = 0; i < MASTERS; i++) {
        masters[i].origin = (uint8_t)(i == 0 ? 1 : 3 + i);
        masters[i].one_for_all = i & 1;
        masters[i].sent = 1;
        masters[i].broadcasts = 0x80;
        memset(masters[i].sequence, 0x80 + (int)below(0x80), sizeof masters[i].sequence);
    }
    start_nodes();
    last_steps = 0;
    for (uint64_t i = 0; tally.commands < commands; i++) {
        master_t *master = &masters[below(MASTERS)];
        if (i % 2000 == 1999) {
            add_counters(&tally.resent);
            broadcast(master, ++last_steps);
            add_counters(&tally.resent_to_all);
        }
        command(master, below(NODES), ++last_steps, i % 500 == 0);
    }
    add_counters(&tally.resent);
    for (unsigned i = 0; i < NODES; i++) {
        TEST_ASSERT_EQUAL_UINT32(0, node[i]->clashes());
    }
}

static uint64_t number(const char *name, uint64_t otherwise)
{
    const char *text = getenv(name);
    return text != NULL ? strtoull(text, NULL, 10) : otherwise;
}

/* NET-030, NET-012 */
static void test_each_command_is_executed_once_whatever_is_lost(void)
{
    random_state = number("SAC_BUS_SEED", 1);
    loss = 1.0 / (double)number("SAC_BUS_LOSS", 50);
    load_nodes();
    run(number("SAC_BUS_COMMANDS", 20000));
    printf("%" PRIu64 " commands to %d nodes from %d masters, %" PRIu64 " of them refused; %" PRIu64 " sequences alone, %" PRIu64
           " broadcasts\n",
           tally.commands, NODES, MASTERS, tally.refused, tally.greetings, tally.broadcasts);
    printf("to the nodes %" PRIu64 " packets: %" PRIu64 " lost, %" PRIu64 " cut, %" PRIu64 " with wrong bits; answers: %" PRIu64
           " lost, %" PRIu64 " cut, %" PRIu64 " with wrong bits; %" PRIu64 " retries\n",
           tally.packets, tally.lost, tally.cut, tally.wrong, tally.answers_lost, tally.answers_cut, tally.answers_wrong,
           tally.retries);
    printf("the nodes: %" PRIu64 " good packets, %" PRIu64 " with a wrong CRC, %" PRIu64 " discarded; %" PRIu64
           " repeats of %" PRIu64 " that were due, %" PRIu64 " of broadcasts; %" PRIu64 " commands executed, %" PRIu64
           " broadcasts missed by a node\n",
           tally.good, tally.bad_crc, tally.discarded, tally.resent, tally.repeats_due, tally.resent_to_all, tally.executed,
           tally.missed);
    TEST_ASSERT_EQUAL_UINT64(tally.commands - tally.refused, tally.executed);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(tally.repeats_due, tally.resent); /* some by chance: a greeting with the number of the last broadcast */
    TEST_ASSERT_GREATER_THAN_UINT64(0, tally.repeats_due);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_command_is_executed_once_whatever_is_lost);
    return UNITY_END();
}
