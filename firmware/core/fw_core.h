/* The firmware of a device, without its hardware: what docs/protocol.md asks of one.
 *
 * A board calls, once for each tick and in this order:
 *
 *     measure              fill fw_inputs
 *     fw_receive           the bytes that came since the last tick
 *     fw_tick              decides; fw_outputs state what the motors do until the next tick
 *     drive                as fw_outputs state
 *     fw_take              the bytes for the host
 *
 * All from one context (the loop, or one interrupt). So a COMMAND acts one tick after the STATE that
 * it answers, at the least. Portable C99: no allocation, no globals, float only; all state is in
 * fw_core, which the caller owns. Do not read or write its members: use the functions.
 */
#ifndef FW_CORE_H
#define FW_CORE_H

#include "fw_board.h"
#include "fw_render.h"
#include "sc_wire.h"

enum { FW_RELEASE = 0, FW_DRIVE = 1, FW_BRAKE = 2 };

/* Phases: firmware/README.md has the table of what leads from one to another. */
enum { FW_UNHOMED = 0, FW_HOMING = 1, FW_READY = 2, FW_ENABLED = 3, FW_FAULT = 4 };

/* Bits of fw_inputs.flags. */
enum {
    FW_IN_STOP_BUTTON = 1,    /* pressed, or its line is broken */
    FW_IN_DRIVER_FAULT = 2,   /* the bridge reports a fault */
    FW_IN_ENCODER_BAD = 4,    /* an encoder reports a fault, or its frame has a wrong checksum */
    FW_IN_AT_HOME = 8,        /* the home switch is pressed */
    FW_IN_FORCE_SATURATED = 16 /* the force sensor is at the end of its range */
};

/* Why homing ended. */
enum {
    FW_HOME_NOT_TRIED = 0,
    FW_HOME_FOUND = 1,
    FW_HOME_STOPPED = 2,   /* HOME = 0, or 5 s without a frame from the host */
    FW_HOME_TIMED_OUT = 3, /* moved, but home did not come within home_timeout */
    FW_HOME_JAMMED = 4,    /* home_timeout passed and home_torque did not move the blades */
    FW_HOME_FAULT = 5,     /* a fault latched meanwhile */
    FW_CAUSE_HOME = 64     /* added to these: `cause` of a STATE without a zero and without a fault */
};

typedef struct {
    uint32_t device_us;  /* clock at the moment at which opening was measured; fw_extend_us */
    float opening;       /* rad, as the encoder gives it: homing adds the zero */
    float advance;       /* m */
    float motor_torque;  /* N m, where measured (TORQUE_MEASURED) */
    float handle_force;  /* N, where measured (HANDLE_FORCE_SENSOR) */
    float current;       /* A of the opening motor, where measured (TORQUE_MEASURED) */
    float supply;        /* V, where the board watches it */
    float temperature;   /* degC, where the board watches it */
    uint32_t flags;      /* FW_IN_... */
} fw_inputs;

typedef struct {
    float torque;   /* N m; 0 unless drive is FW_DRIVE */
    float force;    /* N; 0 unless drive is FW_DRIVE */
    uint32_t drive; /* FW_RELEASE: no current. FW_DRIVE: torque and force. FW_BRAKE: short the windings */
} fw_outputs;

enum { FW_REPLY_BYTES = 512, FW_STATE_FRAME = SC_SIZE_STATE + 4 };

/* Frames for the host: replies in order, and one STATE. */
typedef struct {
    uint8_t replies[FW_REPLY_BYTES];
    uint8_t state[FW_STATE_FRAME];
    uint16_t reply_fill;
    uint16_t reply_sent;  /* bytes of replies that were taken */
    uint8_t state_fill;
    uint8_t state_sent;   /* bytes of the STATE that were taken */
} fw_outbox;

typedef struct {
    fw_board board;
    fw_render *render;       /* null where the board gave no memory for an image */
    sc_decoder decoder;
    fw_outbox outbox;
    sc_command command;      /* in force */
    uint32_t sequence;
    uint32_t command_ticks;  /* since the COMMAND in force came */
    uint32_t unheard_ticks;  /* since the last valid frame */
    uint32_t home_ticks;     /* since homing began */
    uint32_t home_still;     /* ticks without motion while homing */
    float brake_after_ms;
    float tick_s;
    float passed_s;          /* from the last measurement to this one, by device_us */
    uint32_t last_us;        /* device_us of the last measurement */
    float opening_zero;      /* rad, added to the encoder's opening */
    float last_opening;      /* rad, of the last tick, as the encoder gave it */
    float last_advance;      /* m */
    float rate;              /* rad/s, over some four ticks */
    float heat;              /* A^2 s above what the motor bears for hours */
    float torque;            /* N m, given in the last tick */
    float force;             /* N */
    float home_start;        /* rad, where homing began, as the encoder gave it */
    float home_from;         /* rad, where the blades were when they last moved while homing */
    uint8_t problem;         /* FW_BOARD_... */
    uint8_t phase;
    uint8_t cause;           /* SC_CAUSE_... of the fault that stands */
    uint8_t lost;
    uint8_t streaming;
    uint8_t homed;
    uint8_t home_result;     /* FW_HOME_... */
    uint8_t home_asked;      /* HOME = 1 came since the last tick */
    uint8_t home_leaving;    /* away from the switch or the stop first */
    uint8_t home_moved;
    uint8_t clear_asked;     /* CLEAR_FAULT came since the last tick */
    uint8_t measured;        /* last_opening holds a reading */
    uint8_t encoder_doubt;   /* ticks until the encoders are believed again */
    uint8_t saturated;
    uint8_t rendering;
} fw_core;

/* Start with motors released, nothing streamed and no fault. Returns 1; 0 where the table is
 * impossible (fw_board_problem): such a core never drives and never answers. */
int fw_init(fw_core *core, const fw_board *board);

/* Let the core load and render packages, with *render and capacity bytes of memory, both the caller's
 * and for nobody else; after fw_init. Without it LOAD messages are refused. */
void fw_let_render(fw_core *core, fw_render *render, float *memory, uint32_t capacity);

/* Take bytes from the host, in pieces of any size. */
void fw_receive(fw_core *core, const uint8_t *data, size_t size);

/* Pass one tick. */
void fw_tick(fw_core *core, const fw_inputs *inputs, fw_outputs *outputs);

/* Move at most capacity bytes for the host to data and return how many. What is left stays: replies
 * in order, and the newest STATE that has not begun. A STATE that cannot begin in its tick is
 * dropped for the next one. */
size_t fw_take(fw_core *core, uint8_t *data, size_t capacity);

/* For the board's own display. */
int fw_phase(const fw_core *core);
int fw_cause(const fw_core *core);
int fw_home_result(const fw_core *core);

/* Extend a timer of fewer than 32 bits: its last extended value and its present reading give the
 * present extended value. Call it at least once in each period of the timer. */
uint32_t fw_extend_us(uint32_t last, uint32_t reading, unsigned bits);

#endif
