/* The block of shared memory through which a supervisor controls the loop and reads its samples.
 *
 * One process runs the loop on the block, another holds the same memory. Orders and counters pass
 * through GCC's __atomic builtins, in this file and sc_loop only; the rest of the core needs none.
 * The reference arrays (opening, opening_rate, advance, stroke) follow the struct, each with
 * reference_capacity entries.
 */
#ifndef SC_BLOCK_H
#define SC_BLOCK_H

#include "sc_control_block.h"
#include "sc_servo.h"

enum {
    SC_BLOCK_MAGIC = 0x4B4C4253,
    SC_BLOCK_VERSION = 9, /* of this layout; both sides must agree */
    SC_RING_SAMPLES = 32768,
    SC_TICKS_OF_A_STALL = 5,
    SC_HISTOGRAM_BINS = 192,
    SC_BINS_PER_OCTAVE = 8
};

typedef struct {
    float x[SC_TABLE_MAX];
    float y[SC_TABLE_MAX];
    float slope[SC_TABLE_MAX];
    float area[SC_TABLE_MAX];
    int32_t size;
} sc_table_store;

/* Bin i counts times from (8 + i % 8) * 2^(i / 8) / 8 microseconds on, the first everything below,
 * the last everything above: 8 bins to the octave, from 1 us to 16 s. */
typedef struct {
    uint64_t count[SC_HISTOGRAM_BINS];
    uint64_t largest_ns;
    uint64_t total;
} sc_histogram;

/* A CONFIG that the loop sends for the supervisor. */
typedef struct {
    uint32_t wanted;   /* counts requests */
    uint32_t answered; /* number of the request that the echo below answers */
    uint64_t content;  /* key, and above it the bits of the value: no half of a request is ever sent */
    uint32_t status;
    float value_in_force;
} sc_mailbox;

/* The newest estimate of the plate's pose, behind a sequence lock: turn is odd while it is written. */
typedef struct {
    uint32_t turn;
    sc_placing placing;
} sc_placing_lock;

typedef struct {
    uint32_t magic;
    uint32_t version;
    uint64_t size;
    uint32_t reference_capacity;
    uint32_t reference_size;
    uint32_t has_model;
    uint32_t silence_limit_ms; /* without a valid STATE, after which the loop ends */
    uint32_t running;
    uint32_t exit_reason; /* SC_STOP_... once the loop has ended */
    int32_t exit_errno;
    uint32_t garbled;
    uint32_t realtime;      /* 1 if the loop has real-time priority ... */
    uint32_t memory_locked; /* ... and its memory is never paged out */
    uint64_t bytes_received;
    uint64_t other_frames; /* valid, but no STATE */
    uint64_t answers;      /* commands written */
    uint64_t unsent;       /* commands that the line did not accept in time */
    uint64_t stalls;       /* longer than SC_TICKS_OF_A_STALL between two STATE by the host's clock */
    int64_t held_up_ns;    /* longest time in which this computer did not run the loop ... */
    int64_t recent_held_up_ns; /* ... and the longest lately, ... */
    int64_t recent_held_up_until_ns; /* ... which ended then, by CLOCK_MONOTONIC */
    int64_t started_ns;
    sc_orders orders;
    sc_mailbox mailbox;
    sc_placing_lock plate;
    sc_control_block control;
    sc_servo_config config;
    sc_servo servo;
    sc_model model; /* its tables point nowhere; see sc_block_model */
    sc_table_store edge, response, friction_opening, friction_closing, friction_angle;
    sc_histogram latency;  /* from a frame's arrival to its command's departure */
    sc_histogram interval; /* between arrivals */
    uint64_t written;      /* samples ever written to the ring */
    sc_sample ring[SC_RING_SAMPLES];
} sc_block;

uint64_t sc_block_size(uint32_t reference_capacity);

/* Zero the memory and state its layout. */
void sc_block_init(sc_block *block, uint32_t reference_capacity);

/* 1 if memory of this many bytes holds a block of this layout. */
int sc_block_is_sound(const sc_block *block, uint64_t size);

/* Views into the block: the model, 0 if it has none or an invalid one; the reference. */
int sc_block_model(const sc_block *block, sc_model *model);
void sc_block_reference(const sc_block *block, sc_reference *reference);

/* What CONTROL follows: the configuration, and the reference arrays as its path (place, its rate,
 * force, stage). The contour stays as it is. */
void sc_block_task(const sc_block *block, sc_control_task *task);

/* The supervisor's side. */
void sc_block_order(sc_block *block, uint32_t mode);
void sc_block_fresh_sheet(sc_block *block, float crack);
void sc_block_place(sc_block *block, const sc_placing *placing);
void sc_block_beat(sc_block *block);
void sc_block_stop(sc_block *block);
void sc_block_set_reference_size(sc_block *block, uint32_t size); /* once the arrays are filled */
uint32_t sc_block_request(sc_block *block, uint32_t key, float value);
int sc_block_answered(const sc_block *block, uint32_t request);

/* Copy up to n samples from *cursor on and move it; adds to *lost those that were overwritten. */
uint64_t sc_block_read(const sc_block *block, uint64_t *cursor, sc_sample *samples, uint64_t n,
                       uint64_t *lost);

/* The loop's side. */
void sc_block_read_orders(const sc_block *block, sc_orders *orders);
void sc_block_push(sc_block *block, const sc_sample *sample);

/* 1, and the newest estimate, where there is one since the last call; *turn is for this function. One
 * that is being written comes with a later call. */
int sc_block_placed(const sc_block *block, uint32_t *turn, sc_placing *placing);
uint32_t sc_block_wanted(const sc_block *block, uint32_t *key, float *value);
void sc_block_answer(sc_block *block, uint32_t request, uint32_t status, float value);

void sc_histogram_add(sc_histogram *histogram, int64_t time_ns);

#endif
