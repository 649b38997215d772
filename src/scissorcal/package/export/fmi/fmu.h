/* An instance of the FMU: the model of a package or of one of its draws, and the state of a run. */
#ifndef SCISSORCAL_FMU_H
#define SCISSORCAL_FMU_H

#include "scissorcal_fmu.h" /* of the package: FMI3_FUNCTION_PREFIX, token, draws, parameters */

#include "fmi3.h"

/* Value references; those of the parameters follow. */
enum {
    FMU_TIME,
    FMU_OPENING,
    FMU_RATE,
    FMU_ADVANCE,
    FMU_TORQUE,
    FMU_FORCE,
    FMU_CRACK,
    FMU_FLAGS,
    FMU_DRAW,
    FMU_CRACK_START,
    FMU_FIRST_PARAMETER
};

typedef enum { FMU_INSTANTIATED, FMU_INITIALIZATION, FMU_STEP_MODE, FMU_TERMINATED } fmu_phase;

/* All that changes in a run; what fmi3GetFMUState copies. */
typedef struct {
    fmu_phase phase;
    double time;      /* end of the last step [s] */
    double last_size; /* of the last step [s]; 0: none yet */
    double opening, rate, advance, crack_start;
    int32_t draw; /* -1: the package's own parameters */
    sc_crack crack;
    sc_step_output out; /* of the last step */
} fmu_state;

typedef struct {
    fmu_state state;
    sc_model model;
    float area[FMU_RESPONSE_KNOTS];
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} fmu;

/* Report, and give the status back. */
fmi3Status fmu_log(const fmu *self, fmi3Status status, const char *message);

/* Put the model of the state's draw in place: -1 is the package as it is. */
void fmu_choose(fmu *self);

/* The outputs: of the last step; before the first, of a step at the inputs that moves no crack. */
sc_step_output fmu_outputs(const fmu *self);

#endif
