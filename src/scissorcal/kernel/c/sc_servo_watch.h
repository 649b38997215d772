/* What the servo watches: the supervisor, time, the device's clock, and whether places are usable.
 * For sc_servo.c alone; callers of the servo need sc_servo.h only. */
#ifndef SC_SERVO_WATCH_H
#define SC_SERVO_WATCH_H

#include "sc_servo.h"

/* Begin a mode again. The energy stored in the model's material ends with its mode. */
void sc_servo_engage(sc_servo *servo, uint32_t mode);

/* Follow the supervisor: a new order engages its mode, a new sheet moves the crack. */
void sc_servo_obey(const sc_orders *orders, sc_servo *servo);

/* Take a state's time and sequence number. Stops where the two contradict each other too often, and
 * where the sequence fell; the reference of TRACK moves by the ticks that passed, by one where they
 * are in doubt. */
void sc_servo_count_frame(const sc_servo_config *config, sc_servo *servo, const sc_state *state);

/* Whether the place is one that the blades can have, and can have come to since the last one. */
int sc_servo_is_plausible(const sc_servo_config *config, sc_servo *servo, const sc_state *state);

/* Let the time of a state pass whose place is not usable. */
void sc_servo_pass_unused(sc_servo *servo);

/* Stop where the blades move faster than allowed while a mode drives them. */
void sc_servo_watch_speed(const sc_servo_config *config, sc_servo *servo);

/* Have the watches take a state, after the command for it is known; what they see ends the servo: at
 * once where torque and damping may drive the blades, else gently. */
void sc_servo_watch_state(const sc_servo_config *config, sc_servo *servo, const sc_state *state,
                          float time_s, int usable);

#endif
