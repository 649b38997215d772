/* The interface of FMI 3.0 in C, as far as a C compiler needs it to build this FMU: types and functions
 * by the names, orders and values that the standard states (Modelica Association, Functional Mock-up
 * Interface 3.0, fmi-standard.org). */
#ifndef SCISSORCAL_FMI3_H
#define SCISSORCAL_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef int16_t fmi3Int16;
typedef int32_t fmi3Int32;
typedef int64_t fmi3Int64;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef uint16_t fmi3UInt16;
typedef uint32_t fmi3UInt32;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;

#define fmi3Version "3.0"
enum { fmi3False = 0, fmi3True = 1 };

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;

typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;

typedef enum {
    fmi3IntervalNotYetKnown,
    fmi3IntervalUnchanged,
    fmi3IntervalChanged
} fmi3IntervalQualifier;

/* What the importer gives, to be called by the FMU. */
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category,
                                       fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64 time,
                                               fmi3Boolean set_requested, fmi3Boolean get_allowed,
                                               fmi3Boolean step_finished, fmi3Boolean may_return,
                                               fmi3Boolean *returns, fmi3Float64 *return_time);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);

/* An importer that links sources of several FMUs gives each a prefix; a shared library has none. */
#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX)
#define FMI3_PASTE(prefix, name) prefix##name
#define FMI3_PREFIXED(prefix, name) FMI3_PASTE(prefix, name)
#define fmi3GetVersion FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetVersion)
#define fmi3SetDebugLogging FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetDebugLogging)
#define fmi3InstantiateCoSimulation FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3InstantiateCoSimulation)
#define fmi3FreeInstance FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3FreeInstance)
#define fmi3EnterInitializationMode FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterInitializationMode)
#define fmi3ExitInitializationMode FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3ExitInitializationMode)
#define fmi3Terminate FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3Terminate)
#define fmi3Reset FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3Reset)
#define fmi3DoStep FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3DoStep)
#define fmi3GetFMUState FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetFMUState)
#define fmi3SetFMUState FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetFMUState)
#define fmi3FreeFMUState FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3FreeFMUState)
#define fmi3GetFloat64 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetFloat64)
#define fmi3SetFloat64 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetFloat64)
#define fmi3GetUInt32 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt32)
#define fmi3GetInt32 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt32)
#define fmi3SetInt32 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt32)
#define fmi3GetFloat32 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetFloat32)
#define fmi3SetFloat32 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetFloat32)
#define fmi3GetInt8 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt8)
#define fmi3SetInt8 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt8)
#define fmi3GetUInt8 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt8)
#define fmi3SetUInt8 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt8)
#define fmi3GetInt16 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt16)
#define fmi3SetInt16 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt16)
#define fmi3GetUInt16 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt16)
#define fmi3SetUInt16 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt16)
#define fmi3GetInt64 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt64)
#define fmi3SetInt64 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt64)
#define fmi3GetUInt64 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt64)
#define fmi3SetUInt64 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt64)
#define fmi3GetBoolean FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetBoolean)
#define fmi3SetBoolean FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetBoolean)
#define fmi3GetString FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetString)
#define fmi3SetString FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetString)
#define fmi3SetUInt32 FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt32)
#define fmi3GetBinary FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetBinary)
#define fmi3SetBinary FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetBinary)
#define fmi3GetClock FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetClock)
#define fmi3SetClock FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetClock)
#define fmi3EnterEventMode FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterEventMode)
#define fmi3GetNumberOfVariableDependencies FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfVariableDependencies)
#define fmi3GetVariableDependencies FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetVariableDependencies)
#define fmi3SerializedFMUStateSize FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SerializedFMUStateSize)
#define fmi3SerializeFMUState FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SerializeFMUState)
#define fmi3DeserializeFMUState FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3DeserializeFMUState)
#define fmi3GetDirectionalDerivative FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetDirectionalDerivative)
#define fmi3GetAdjointDerivative FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetAdjointDerivative)
#define fmi3EnterConfigurationMode FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterConfigurationMode)
#define fmi3ExitConfigurationMode FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3ExitConfigurationMode)
#define fmi3GetIntervalDecimal FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetIntervalDecimal)
#define fmi3GetIntervalFraction FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetIntervalFraction)
#define fmi3GetShiftDecimal FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetShiftDecimal)
#define fmi3GetShiftFraction FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetShiftFraction)
#define fmi3SetIntervalDecimal FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetIntervalDecimal)
#define fmi3SetIntervalFraction FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetIntervalFraction)
#define fmi3SetShiftDecimal FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetShiftDecimal)
#define fmi3SetShiftFraction FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetShiftFraction)
#define fmi3EvaluateDiscreteStates FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EvaluateDiscreteStates)
#define fmi3UpdateDiscreteStates FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3UpdateDiscreteStates)
#define fmi3EnterContinuousTimeMode FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterContinuousTimeMode)
#define fmi3CompletedIntegratorStep FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3CompletedIntegratorStep)
#define fmi3SetTime FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetTime)
#define fmi3SetContinuousStates FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetContinuousStates)
#define fmi3GetContinuousStateDerivatives FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetContinuousStateDerivatives)
#define fmi3GetEventIndicators FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetEventIndicators)
#define fmi3GetContinuousStates FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetContinuousStates)
#define fmi3GetNominalsOfContinuousStates FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNominalsOfContinuousStates)
#define fmi3GetNumberOfEventIndicators FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfEventIndicators)
#define fmi3GetNumberOfContinuousStates FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfContinuousStates)
#define fmi3EnterStepMode FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterStepMode)
#define fmi3GetOutputDerivatives FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetOutputDerivatives)
#define fmi3ActivateModelPartition FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3ActivateModelPartition)
#define fmi3InstantiateModelExchange FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3InstantiateModelExchange)
#define fmi3InstantiateScheduledExecution FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3InstantiateScheduledExecution)
#endif

#if defined(_WIN32)
#define FMI3_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI3_EXPORT __attribute__((visibility("default")))
#else
#define FMI3_EXPORT
#endif

FMI3_EXPORT const char *fmi3GetVersion(void);
FMI3_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t
                                           nCategories, const fmi3String categories[]);
FMI3_EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath, fmi3Boolean
    visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed, const
    fmi3ValueReference requiredIntermediateVariables[], size_t nRequiredIntermediateVariables,
    fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
    fmi3IntermediateUpdateCallback intermediateUpdate);
FMI3_EXPORT void fmi3FreeInstance(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3EnterInitializationMode(
    fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance, fmi3Float64
    startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime);
FMI3_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3Terminate(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3Reset(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                                  fmi3Float64 communicationStepSize, fmi3Boolean
                                  noSetFMUStatePriorToCurrentPoint, fmi3Boolean
                                  *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                                  fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime);
FMI3_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState);
FMI3_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState);
FMI3_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState);
FMI3_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference
                                      valueReferences[], size_t nValueReferences, fmi3Float64
                                      values[], size_t nValues);
FMI3_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference
                                      valueReferences[], size_t nValueReferences, const fmi3Float64
                                      values[], size_t nValues);
FMI3_EXPORT fmi3Status fmi3GetUInt32(fmi3Instance instance, const fmi3ValueReference
                                     valueReferences[], size_t nValueReferences, fmi3UInt32
                                     values[], size_t nValues);
FMI3_EXPORT fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference
                                    valueReferences[], size_t nValueReferences, fmi3Int32 values[],
                                    size_t nValues);
FMI3_EXPORT fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference
                                    valueReferences[], size_t nValueReferences, const fmi3Int32
                                    values[], size_t nValues);
FMI3_EXPORT fmi3Status fmi3GetFloat32(fmi3Instance instance, const fmi3ValueReference references[],
                                      size_t count, fmi3Float32 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetFloat32(fmi3Instance instance, const fmi3ValueReference references[],
                                      size_t count, const fmi3Float32 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetInt8(fmi3Instance instance, const fmi3ValueReference references[],
                                   size_t count, fmi3Int8 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetInt8(fmi3Instance instance, const fmi3ValueReference references[],
                                   size_t count, const fmi3Int8 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetUInt8(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, fmi3UInt8 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetUInt8(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, const fmi3UInt8 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetInt16(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, fmi3Int16 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetInt16(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, const fmi3Int16 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetUInt16(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, fmi3UInt16 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetUInt16(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, const fmi3UInt16 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetInt64(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, fmi3Int64 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetInt64(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, const fmi3Int64 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetUInt64(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, fmi3UInt64 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetUInt64(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, const fmi3UInt64 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference references[],
                                      size_t count, fmi3Boolean values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference references[],
                                      size_t count, const fmi3Boolean values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, fmi3String values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, const fmi3String values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetUInt32(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, const fmi3UInt32 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, size_t sizes[], fmi3Binary values[], size_t size);
FMI3_EXPORT fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference references[],
                                     size_t count, const size_t sizes[], const fmi3Binary values[],
                                     size_t size);
FMI3_EXPORT fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, fmi3Clock values[]);
FMI3_EXPORT fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference references[],
                                    size_t count, const fmi3Clock values[]);
FMI3_EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3GetNumberOfVariableDependencies(
    fmi3Instance instance, fmi3ValueReference reference, size_t *count);
FMI3_EXPORT fmi3Status fmi3GetVariableDependencies(
    fmi3Instance instance, fmi3ValueReference dependent, size_t elements[], fmi3ValueReference
    independents[], size_t others[], fmi3DependencyKind kinds[], size_t count);
FMI3_EXPORT fmi3Status fmi3SerializedFMUStateSize(
    fmi3Instance instance, fmi3FMUState state, size_t *size);
FMI3_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte
                                             bytes[], size_t size);
FMI3_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t
                                               size, fmi3FMUState *state);
FMI3_EXPORT fmi3Status fmi3GetDirectionalDerivative(
    fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns, const
    fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64
    sensitivity[], size_t nSensitivity);
FMI3_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference
                                                unknowns[], size_t nUnknowns, const
                                                fmi3ValueReference knowns[], size_t nKnowns, const
                                                fmi3Float64 seed[], size_t nSeed, fmi3Float64
                                                sensitivity[], size_t nSensitivity);
FMI3_EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference
                                              references[], size_t count, fmi3Float64 intervals[],
                                              fmi3IntervalQualifier qualifiers[]);
FMI3_EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference
                                               references[], size_t count, fmi3UInt64 counters[],
                                               fmi3UInt64 resolutions[], fmi3IntervalQualifier
                                               qualifiers[]);
FMI3_EXPORT fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference
                                           references[], size_t count, fmi3Float64 shifts[]);
FMI3_EXPORT fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference
                                            references[], size_t count, fmi3UInt64 counters[],
                                            fmi3UInt64 resolutions[]);
FMI3_EXPORT fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference
                                              references[], size_t count, const fmi3Float64
                                              intervals[]);
FMI3_EXPORT fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference
                                               references[], size_t count, const fmi3UInt64
                                               counters[], const fmi3UInt64 resolutions[]);
FMI3_EXPORT fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference
                                           references[], size_t count, const fmi3Float64 shifts[]);
FMI3_EXPORT fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference
                                            references[], size_t count, const fmi3UInt64 counters[],
                                            const fmi3UInt64 resolutions[]);
FMI3_EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again,
                                                fmi3Boolean *terminate, fmi3Boolean *nominals,
                                                fmi3Boolean *states, fmi3Boolean *defined,
                                                fmi3Float64 *next);
FMI3_EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3CompletedIntegratorStep(
    fmi3Instance instance, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *terminate);
FMI3_EXPORT fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time);
FMI3_EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 states[],
                                               size_t count);
FMI3_EXPORT fmi3Status fmi3GetContinuousStateDerivatives(
    fmi3Instance instance, fmi3Float64 values[], size_t count);
FMI3_EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 values[], size_t
                                              count);
FMI3_EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 values[], size_t
                                               count);
FMI3_EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(
    fmi3Instance instance, fmi3Float64 values[], size_t count);
FMI3_EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count);
FMI3_EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count);
FMI3_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance instance);
FMI3_EXPORT fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference
                                                references[], size_t count, const fmi3Int32
                                                orders[], fmi3Float64 values[], size_t size);
FMI3_EXPORT fmi3Status fmi3ActivateModelPartition(
    fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time);
FMI3_EXPORT fmi3Instance fmi3InstantiateModelExchange(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean loggingOn,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log);
FMI3_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean loggingOn,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock);

#endif
