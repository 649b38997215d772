/* Values of the FMU's variables, by their references. */
#include "fmu.h"

static fmi3Status unknown(const fmu *self)
{
    return fmu_log(self, fmi3Error, "there is no variable of this type with this value reference");
}

static const char NOT_NOW[] = "inputs are set until the end of a run, parameters until initialization "
                              "mode is left, and nothing else is";

static int may_set_parameters(const fmu *self)
{
    return self->state.phase == FMU_INSTANTIATED || self->state.phase == FMU_INITIALIZATION;
}

static fmi3Status get_float(const fmu *self, fmi3ValueReference reference, double *value)
{
    const fmu_state *state = &self->state;
    switch (reference) {
    case FMU_TIME: *value = state->time; return fmi3OK;
    case FMU_OPENING: *value = state->opening; return fmi3OK;
    case FMU_RATE: *value = state->rate; return fmi3OK;
    case FMU_ADVANCE: *value = state->advance; return fmi3OK;
    case FMU_CRACK_START: *value = state->crack_start; return fmi3OK;
    case FMU_TORQUE: *value = (double)fmu_outputs(self).torque; return fmi3OK;
    case FMU_FORCE: *value = (double)fmu_outputs(self).force; return fmi3OK;
    case FMU_CRACK:
        *value = state->last_size > 0.0 ? (double)state->crack.crack
                                        : (double)(float)state->crack_start;
        return fmi3OK;
    default: break;
    }
    if (reference < FMU_FIRST_PARAMETER || reference >= FMU_FIRST_PARAMETER + FMU_PARAMETERS) {
        return unknown(self);
    }
    *value = FMU_PARAMETER[state->draw + 1][reference - FMU_FIRST_PARAMETER];
    return fmi3OK;
}

static fmi3Status set_float(fmu *self, fmi3ValueReference reference, double value)
{
    fmu_state *state = &self->state;
    if (reference == FMU_CRACK_START ? !may_set_parameters(self) : state->phase == FMU_TERMINATED) {
        return fmu_log(self, fmi3Error, NOT_NOW);
    }
    switch (reference) {
    case FMU_OPENING: state->opening = value; return fmi3OK;
    case FMU_RATE: state->rate = value; return fmi3OK;
    case FMU_ADVANCE: state->advance = value; return fmi3OK;
    case FMU_CRACK_START: state->crack_start = value; return fmi3OK;
    default: return unknown(self);
    }
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, fmi3Float64 values[], size_t nValues)
{
    fmi3Status status = fmi3OK;
    for (size_t i = 0; i < nValueReferences && i < nValues && status == fmi3OK; i++) {
        status = get_float(instance, valueReferences[i], &values[i]);
    }
    return status;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                          size_t nValueReferences, const fmi3Float64 values[], size_t nValues)
{
    fmi3Status status = fmi3OK;
    for (size_t i = 0; i < nValueReferences && i < nValues && status == fmi3OK; i++) {
        status = set_float(instance, valueReferences[i], values[i]);
    }
    return status;
}

fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, fmi3UInt32 values[], size_t nValues)
{
    const fmu *self = instance;
    for (size_t i = 0; i < nValueReferences && i < nValues; i++) {
        if (valueReferences[i] != FMU_FLAGS) {
            return unknown(self);
        }
        values[i] = fmu_outputs(self).flags;
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, fmi3Int32 values[], size_t nValues)
{
    const fmu *self = instance;
    for (size_t i = 0; i < nValueReferences && i < nValues; i++) {
        if (valueReferences[i] != FMU_DRAW) {
            return unknown(self);
        }
        values[i] = self->state.draw;
    }
    return fmi3OK;
}

fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, const fmi3Int32 values[], size_t nValues)
{
    fmu *self = instance;
    for (size_t i = 0; i < nValueReferences && i < nValues; i++) {
        if (valueReferences[i] != FMU_DRAW) {
            return unknown(self);
        }
        if (!may_set_parameters(self)) {
            return fmu_log(self, fmi3Error, NOT_NOW);
        }
        if (values[i] < -1 || values[i] >= FMU_DRAWS) {
            return fmu_log(self, fmi3Error, "draw is -1 for the package's own parameters, or a draw's index");
        }
        self->state.draw = values[i];
        fmu_choose(self);
    }
    return fmi3OK;
}
