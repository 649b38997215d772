/* What FMI 3.0 asks an FMU to have and this one does not support: each answers fmi3Error and logs its name.
 * A request for no variables is answered with fmi3OK. */
#include "fmu.h"

static fmi3Status lacks(fmi3Instance instance, const char *name)
{
    return fmu_log(instance, fmi3Error, name);
}

#define LACKS(name) "the FMU does not support " #name

#define GET(name, type)                                                                             \
    fmi3Status name(fmi3Instance instance, const fmi3ValueReference references[], size_t count,     \
                    type values[], size_t size)                                                     \
    {                                                                                               \
        (void)references;                                                                           \
        (void)values;                                                                               \
        (void)size;                                                                                 \
        return count == 0 ? fmi3OK : lacks(instance, LACKS(name));                                  \
    }

GET(fmi3GetFloat32, fmi3Float32)
GET(fmi3SetFloat32, const fmi3Float32)
GET(fmi3GetInt8, fmi3Int8)
GET(fmi3SetInt8, const fmi3Int8)
GET(fmi3GetUInt8, fmi3UInt8)
GET(fmi3SetUInt8, const fmi3UInt8)
GET(fmi3GetInt16, fmi3Int16)
GET(fmi3SetInt16, const fmi3Int16)
GET(fmi3GetUInt16, fmi3UInt16)
GET(fmi3SetUInt16, const fmi3UInt16)
GET(fmi3GetInt64, fmi3Int64)
GET(fmi3SetInt64, const fmi3Int64)
GET(fmi3GetUInt64, fmi3UInt64)
GET(fmi3SetUInt64, const fmi3UInt64)
GET(fmi3GetBoolean, fmi3Boolean)
GET(fmi3SetBoolean, const fmi3Boolean)
GET(fmi3GetString, fmi3String)
GET(fmi3SetString, const fmi3String)
GET(fmi3SetUInt32, const fmi3UInt32)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                         size_t sizes[], fmi3Binary values[], size_t size)
{
    (void)references;
    (void)count;
    (void)sizes;
    (void)values;
    (void)size;
    return lacks(instance, LACKS(fmi3GetBinary));
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                         const size_t sizes[], const fmi3Binary values[], size_t size)
{
    (void)references;
    (void)count;
    (void)sizes;
    (void)values;
    (void)size;
    return lacks(instance, LACKS(fmi3SetBinary));
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                        fmi3Clock values[])
{
    (void)references;
    (void)count;
    (void)values;
    return lacks(instance, LACKS(fmi3GetClock));
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                        const fmi3Clock values[])
{
    (void)references;
    (void)count;
    (void)values;
    return lacks(instance, LACKS(fmi3SetClock));
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return lacks(instance, LACKS(fmi3EnterEventMode));
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference reference,
                                               size_t *count)
{
    (void)reference;
    (void)count;
    return lacks(instance, LACKS(fmi3GetNumberOfVariableDependencies));
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent, size_t
                                       elements[], fmi3ValueReference independents[], size_t
                                       others[], fmi3DependencyKind kinds[], size_t count)
{
    (void)dependent;
    (void)elements;
    (void)independents;
    (void)others;
    (void)kinds;
    (void)count;
    return lacks(instance, LACKS(fmi3GetVariableDependencies));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    (void)state;
    (void)size;
    return lacks(instance, LACKS(fmi3SerializedFMUStateSize));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t
                                 size)
{
    (void)state;
    (void)bytes;
    (void)size;
    return lacks(instance, LACKS(fmi3SerializeFMUState));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    (void)bytes;
    (void)size;
    (void)state;
    return lacks(instance, LACKS(fmi3DeserializeFMUState));
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t nUnknowns, const fmi3ValueReference knowns[], size_t
                                        nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64
                                        sensitivity[], size_t nSensitivity)
{
    (void)unknowns;
    (void)nUnknowns;
    (void)knowns;
    (void)nKnowns;
    (void)seed;
    (void)nSeed;
    (void)sensitivity;
    (void)nSensitivity;
    return lacks(instance, LACKS(fmi3GetDirectionalDerivative));
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t nUnknowns, const fmi3ValueReference knowns[], size_t
                                    nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64
                                    sensitivity[], size_t nSensitivity)
{
    (void)unknowns;
    (void)nUnknowns;
    (void)knowns;
    (void)nKnowns;
    (void)seed;
    (void)nSeed;
    (void)sensitivity;
    (void)nSensitivity;
    return lacks(instance, LACKS(fmi3GetAdjointDerivative));
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return lacks(instance, LACKS(fmi3EnterConfigurationMode));
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return lacks(instance, LACKS(fmi3ExitConfigurationMode));
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference references[],
                                  size_t count, fmi3Float64 intervals[], fmi3IntervalQualifier
                                  qualifiers[])
{
    (void)references;
    (void)count;
    (void)intervals;
    (void)qualifiers;
    return lacks(instance, LACKS(fmi3GetIntervalDecimal));
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference references[],
                                   size_t count, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[])
{
    (void)references;
    (void)count;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return lacks(instance, LACKS(fmi3GetIntervalFraction));
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference references[], size_t
                               count, fmi3Float64 shifts[])
{
    (void)references;
    (void)count;
    (void)shifts;
    return lacks(instance, LACKS(fmi3GetShiftDecimal));
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference references[], size_t
                                count, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
{
    (void)references;
    (void)count;
    (void)counters;
    (void)resolutions;
    return lacks(instance, LACKS(fmi3GetShiftFraction));
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference references[],
                                  size_t count, const fmi3Float64 intervals[])
{
    (void)references;
    (void)count;
    (void)intervals;
    return lacks(instance, LACKS(fmi3SetIntervalDecimal));
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference references[],
                                   size_t count, const fmi3UInt64 counters[], const fmi3UInt64
                                   resolutions[])
{
    (void)references;
    (void)count;
    (void)counters;
    (void)resolutions;
    return lacks(instance, LACKS(fmi3SetIntervalFraction));
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference references[], size_t
                               count, const fmi3Float64 shifts[])
{
    (void)references;
    (void)count;
    (void)shifts;
    return lacks(instance, LACKS(fmi3SetShiftDecimal));
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference references[], size_t
                                count, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
{
    (void)references;
    (void)count;
    (void)counters;
    (void)resolutions;
    return lacks(instance, LACKS(fmi3SetShiftFraction));
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return lacks(instance, LACKS(fmi3EvaluateDiscreteStates));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean
                                    *terminate, fmi3Boolean *nominals, fmi3Boolean *states,
                                    fmi3Boolean *defined, fmi3Float64 *next)
{
    (void)again;
    (void)terminate;
    (void)nominals;
    (void)states;
    (void)defined;
    (void)next;
    return lacks(instance, LACKS(fmi3UpdateDiscreteStates));
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return lacks(instance, LACKS(fmi3EnterContinuousTimeMode));
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean final, fmi3Boolean *event,
                                       fmi3Boolean *terminate)
{
    (void)final;
    (void)event;
    (void)terminate;
    return lacks(instance, LACKS(fmi3CompletedIntegratorStep));
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    (void)time;
    return lacks(instance, LACKS(fmi3SetTime));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 states[], size_t count)
{
    (void)states;
    (void)count;
    return lacks(instance, LACKS(fmi3SetContinuousStates));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 values[], size_t
                                             count)
{
    (void)values;
    (void)count;
    return lacks(instance, LACKS(fmi3GetContinuousStateDerivatives));
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 values[], size_t count)
{
    (void)values;
    (void)count;
    return lacks(instance, LACKS(fmi3GetEventIndicators));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 values[], size_t count)
{
    (void)values;
    (void)count;
    return lacks(instance, LACKS(fmi3GetContinuousStates));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 values[], size_t
                                             count)
{
    (void)values;
    (void)count;
    return lacks(instance, LACKS(fmi3GetNominalsOfContinuousStates));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count)
{
    (void)count;
    return lacks(instance, LACKS(fmi3GetNumberOfEventIndicators));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count)
{
    (void)count;
    return lacks(instance, LACKS(fmi3GetNumberOfContinuousStates));
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return lacks(instance, LACKS(fmi3EnterStepMode));
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t size)
{
    (void)references;
    (void)count;
    (void)orders;
    (void)values;
    (void)size;
    return lacks(instance, LACKS(fmi3GetOutputDerivatives));
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clock, fmi3Float64
                                      time)
{
    (void)clock;
    (void)time;
    return lacks(instance, LACKS(fmi3ActivateModelPartition));
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path,
                                          fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    (void)name;
    (void)token;
    (void)path;
    (void)visible;
    (void)loggingOn;
    if (log != NULL) {
        log(environment, fmi3Error, "logStatusError", "the FMU is for co-simulation alone");
    }
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean loggingOn,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    (void)update;
    (void)lock;
    (void)unlock;
    return fmi3InstantiateModelExchange(name, token, path, visible, loggingOn, environment, log);
}
