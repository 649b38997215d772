/* FMI 3.0 co-simulation of a package: life of an instance, steps, and copies of its state.
 *
 * A step of the importer is one step of the model at the inputs as they were set, held over the whole step; the
 * model computes in float. Nothing is interpolated. */
#include "fmu.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

fmi3Status fmu_log(const fmu *self, fmi3Status status, const char *message)
{
    if (self->log != NULL) {
        self->log(self->environment, status,
                  status == fmi3Warning ? "logStatusWarning" : "logStatusError", message);
    }
    return status;
}

void fmu_choose(fmu *self)
{
    self->model = scissorcal_package;
    if (self->state.draw < 0) {
        return;
    }
    fmu_put_draw(self->state.draw, &self->model);
    self->model.response.area = NULL;
    sc_table_accumulate(&self->model.response, self->area);
    self->model.response.area = self->area;
    self->model.flattest = self->model.steepest = 0.0f;
    sc_model_edge_slopes(&self->model);
    self->model.release_falls = sc_model_release_falls(&self->model);
}

static void begin(fmu *self)
{
    memset(&self->state, 0, sizeof self->state);
    self->state.phase = FMU_INSTANTIATED;
    self->state.opening = FMU_OPENING_START;
    self->state.advance = FMU_ADVANCE_START;
    self->state.draw = -1;
    fmu_choose(self);
}

static void take_step(const fmu *self, sc_crack *crack, sc_step_output *out)
{
    const fmu_state *state = &self->state;
    sc_model_step(&self->model, crack, (float)state->opening, (float)state->rate,
                  (float)state->advance, out);
}

sc_step_output fmu_outputs(const fmu *self)
{
    if (self->state.last_size > 0.0) {
        return self->state.out;
    }
    sc_crack crack = {(float)self->state.crack_start, 0, 0, 0};
    sc_step_output out;
    take_step(self, &crack, &out);
    return out;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

/* There are no messages but errors and warnings, which are always reported. */
fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    (void)instance;
    (void)loggingOn;
    (void)nCategories;
    (void)categories;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate)
{
    (void)instanceName;
    (void)resourcePath;
    (void)visible;
    (void)loggingOn;
    (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables;
    (void)intermediateUpdate;
    fmu *self = calloc(1, sizeof *self);
    if (self == NULL) {
        return NULL;
    }
    self->environment = instanceEnvironment;
    self->log = logMessage;
    const char *wrong = NULL;
    if (instantiationToken == NULL || strcmp(instantiationToken, FMU_TOKEN) != 0) {
        wrong = "the token is of another modelDescription.xml: use the binary of the same FMU";
    } else if (eventModeUsed || nRequiredIntermediateVariables > 0) {
        wrong = "neither event mode nor intermediate variables are supported";
    }
    if (wrong != NULL) {
        (void)fmu_log(self, fmi3Error, wrong);
        free(self);
        return NULL;
    }
    begin(self);
    return self;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    fmu *self = instance;
    (void)toleranceDefined;
    (void)tolerance;
    (void)stopTimeDefined;
    (void)stopTime;
    if (self->state.phase != FMU_INSTANTIATED) {
        return fmu_log(self, fmi3Error, "initialization mode is entered once, after instantiation");
    }
    if (!isfinite(startTime)) {
        return fmu_log(self, fmi3Error, "the start time is not finite");
    }
    self->state.time = startTime;
    self->state.phase = FMU_INITIALIZATION;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    fmu *self = instance;
    if (self->state.phase != FMU_INITIALIZATION) {
        return fmu_log(self, fmi3Error, "initialization mode is left only after it was entered");
    }
    self->state.crack.crack = (float)self->state.crack_start;
    self->state.phase = FMU_STEP_MODE;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    fmu *self = instance;
    if (self->state.phase != FMU_STEP_MODE) {
        return fmu_log(self, fmi3Error, "only a run that was initialized is terminated");
    }
    self->state.phase = FMU_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    begin(instance);
    return fmi3OK;
}

/* Why a step cannot be taken; NULL where it can. Communication points that are nearer to one another
 * than half a step are the same: what is between them is the importer's rounding. */
static const char *refusal(const fmu_state *state, double from, double size)
{
    const double shorter =
        state->last_size > 0.0 && state->last_size < size ? state->last_size : size;
    if (state->phase != FMU_STEP_MODE) {
        return "a step is taken only in step mode: leave initialization mode first";
    }
    if (!(size > 0.0) || !isfinite(size) || !isfinite(from)) {
        return "the communication step size must be above 0 and finite";
    }
    if (from < state->time - 0.5 * shorter) {
        return "the step begins before the end of the last one: a crack does not heal; to step again "
               "from an earlier time, set the state that fmi3GetFMUState gave there";
    }
    if (from > state->time + 0.5 * shorter) {
        return "the step begins after the end of the last one: steps follow each other without gaps";
    }
    return NULL;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    fmu *self = instance;
    fmu_state *state = &self->state;
    (void)noSetFMUStatePriorToCurrentPoint;
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = state->time;
    const char *why = refusal(state, currentCommunicationPoint, communicationStepSize);
    if (why != NULL) {
        return fmu_log(self, fmi3Error, why);
    }
    take_step(self, &state->crack, &state->out);
    state->time = currentCommunicationPoint + communicationStepSize;
    state->last_size = communicationStepSize;
    *lastSuccessfulTime = state->time;
    if (state->out.flags & SC_STEP_INVALID) {
        return fmu_log(self, fmi3Warning,
                       "opening, rate or advance cannot be evaluated (not finite, or the edge stands "
                       "upright): torque and force are 0, the crack stays");
    }
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    const fmu *self = instance;
    if (*FMUState == NULL) {
        *FMUState = calloc(1, sizeof self->state);
    }
    if (*FMUState == NULL) {
        return fmu_log(self, fmi3Error, "there is no memory for a copy of the state");
    }
    memcpy(*FMUState, &self->state, sizeof self->state);
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    fmu *self = instance;
    if (FMUState == NULL) {
        return fmu_log(self, fmi3Error, "no state is given");
    }
    memcpy(&self->state, FMUState, sizeof self->state);
    fmu_choose(self);
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    (void)instance;
    if (FMUState != NULL) {
        free(*FMUState);
        *FMUState = NULL;
    }
    return fmi3OK;
}
