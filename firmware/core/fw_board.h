/* A board: the constants of one device, which its maker fills in once.
 *
 * SI units. Torques, angles and currents are those at the blades: a motor behind a gear of ratio n
 * gives n times its own torque at 1/n of its angle. What a board does not have is 0, as stated.
 */
#ifndef FW_BOARD_H
#define FW_BOARD_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    char name[16];             /* ASCII, padded with 0; so is serial */
    char serial[16];
    uint32_t firmware_version; /* the maker's own */
    uint32_t tick_us;          /* 250 to 10,000 */
    uint32_t capabilities;     /* SC_CAPABILITY_...; RENDERS is added where the core renders */
    float torque_limit;        /* N m, largest magnitude */
    float force_limit;         /* N along the cut; 0 without an advance motor */
    float opening_min;         /* rad, lower stop */
    float opening_max;         /* rad, upper stop */
    float advance_min;         /* m; both 0 without a carriage */
    float advance_max;         /* m */
    float opening_resolution;  /* rad, encoder step */
    float advance_resolution;  /* m, encoder step; 0 without a carriage */
    float handle_radius;       /* m, from the pivot to where the hand pushes */
    float torque_slew;         /* N m/s, fastest change of the torque */
    float force_slew;          /* N/s; 0 without an advance motor */
    float overspeed;           /* rad/s at which driven blades are braked */
    float opening_leap;        /* rad; farther than this no blade moves in a tick */
    float advance_leap;        /* m; 0 without a carriage */
    float torque_per_A;        /* N m/A of the opening motor */
    float resistance;          /* ohm of its winding, leads and bridge */
    float current_limit;       /* A, largest magnitude at any time */
    float current_continuous;  /* A that the motor bears for hours */
    float i2t_limit;           /* A^2 s above current_continuous until the winding is too hot */
    float supply_min;          /* V; supply is not watched where supply_max is 0 */
    float supply_max;          /* V */
    float temperature_max;     /* degC; 0: not watched */
    float home_torque;         /* N m towards home, its sign that of the direction; 0 without HOMES */
    float home_speed;          /* rad/s, magnitude */
    float home_opening;        /* rad, what the opening is at home */
    float home_timeout;        /* s */
    uint32_t home_at_stop;     /* 1: home is the stop, 0: home is the switch */
} fw_board;

/* Why a table is impossible. */
enum {
    FW_BOARD_POSSIBLE = 0,
    FW_BOARD_NOT_FINITE = 1,
    FW_BOARD_TICK = 2,
    FW_BOARD_TORQUE_LIMIT = 3,
    FW_BOARD_FORCE_LIMIT = 4,
    FW_BOARD_STOPS = 5,
    FW_BOARD_RESOLUTION = 6,
    FW_BOARD_HANDLE_RADIUS = 7,
    FW_BOARD_SLEW = 8,
    FW_BOARD_OVERSPEED = 9,
    FW_BOARD_LEAP = 10,
    FW_BOARD_MOTOR = 11,
    FW_BOARD_BEYOND_SUPPLY = 12,
    FW_BOARD_CURRENT = 13,
    FW_BOARD_SUPPLY = 14,
    FW_BOARD_TEMPERATURE = 15,
    FW_BOARD_HOME = 16
};

/* Why this table is impossible, FW_BOARD_POSSIBLE (0) where it is not. A sentence that says what to
 * change goes to *sentence, unless that is null. */
int fw_board_problem(const fw_board *board, const char **sentence);

#endif
