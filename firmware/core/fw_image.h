/* The image of a package: a model and how it is driven, as one flat block that is used where it lies.
 *
 * All numbers are little-endian and 4 bytes long: FW_IMAGE_WORDS words of header, then float32 arrays,
 * of each table x, y and slope, of the response its area, too. scissorcal.package.image writes it.
 *
 *     0      magic                     13 to 23  the model's numbers, as sc_model has them
 *     1      FW_IMAGE_FORMAT           24 to 36  fw_drive
 *     2      bytes of the whole image  37 on     the arrays
 *     3      1.0, as this processor reads it
 *     4 to 8 knots of each table; 9 to 12 moving blades, closure, friction, release_falls
 */
#ifndef FW_IMAGE_H
#define FW_IMAGE_H

#include "sc_model.h"

enum {
    FW_IMAGE_MAGIC = 0x494D4353, /* "SCMI" */
    FW_IMAGE_FORMAT = 1,
    FW_IMAGE_WORDS = 37
};

/* What the package, the recipe and the admission allow; signs as the model has them. */
typedef struct {
    float torque_limit;   /* [N m] */
    float torque_slew;    /* [N m/s] */
    float force_limit;    /* [N]; 0 renders no force */
    float force_slew;     /* [N/s] */
    float ramp_s;         /* from nothing to the whole torque, each time the motors are enabled */
    float rate_cutoff_Hz; /* of the rate estimator; 0: none */
    float friction_width; /* see sc_near_rest.h [rad] */
    float is_measured;    /* not 0: motor_torque is measured */
    float rig_damping;    /* of the observer: see sc_passivity.h */
    float rig_coulomb;
    float margin_J;
    float most_damping;
    float motor_sign; /* 1 or -1: below 0 the motor's torque is turned round */
} fw_drive;

typedef struct {
    sc_model model; /* its tables point into the image */
    fw_drive drive;
} fw_image;

/* Look at `bytes` bytes of an image. SC_LOAD_OK, and *image points into it; SC_LOAD_OTHER_FORMAT for
 * another layout or order of bytes; SC_LOAD_TORN where the sizes contradict each other;
 * SC_LOAD_NOT_SOUND for numbers that no model or drive has. Nothing beyond `bytes` is read. */
uint32_t fw_image_open(const float *memory, uint32_t bytes, fw_image *image);

/* CRC-32 (IEEE 802.3, as zlib has it) of count more bytes; 0 begins. */
uint32_t fw_crc32(uint32_t crc, const uint8_t *bytes, uint32_t count);

#endif
