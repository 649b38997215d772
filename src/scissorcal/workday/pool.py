"""Where fits and measurements run: here, in processes of this machine, or on a cluster.

A cluster's worker answers with JSON text: values and errors, never pickles of ours.
"""

import gc
import json
import logging
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import import_module
from typing import Any, ParamSpec, TypeVar

from scissorcal import errors
from scissorcal.errors import DeviceError, InputError, ScissorcalError, needs_extra
from scissorcal.foreign import parse_json
from scissorcal.workday.options import Processes

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")

AHEAD = 2
"""Jobs handed in for each worker, so that none waits for the next one."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Pool:
    """An executor, how many jobs it does at a time, and how many it is handed at once.

    Where it is ``remote``, jobs answer in JSON text (`workday.pool`).
    """

    executor: Executor
    workers: int
    ahead: int = AHEAD
    remote: bool = False

    def work(
        self,
        job: Callable[[T], R],
        items: Iterable[T],
        finished: Callable[[R], None],
        kind: Any,
    ) -> None:
        """Do ``job`` for every item and call ``finished`` here with each result, as they come.

        ``kind`` is the type of a result, to which a cluster's answers are held.
        Raises what a job raised, InputError where a worker lacks a module, ScissorcalError where a
        worker died, and DeviceError where the cluster did.
        """
        todo = iter(items)
        running: set[Future[Any]] = set()
        asked: Callable[[T], Any] = answering(job) if self.remote else job
        try:
            while True:
                while len(running) < self.workers * self.ahead:
                    item = next(todo, _END)
                    if item is _END:
                        break
                    with self._connected():
                        running.add(self.executor.submit(asked, item))  # type: ignore[arg-type]
                if not running:
                    return
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    with self._connected():
                        found = future.result()
                    finished(read_answer(found, kind) if self.remote else found)
        except ModuleNotFoundError as error:
            raise InputError(
                f"The cluster's workers lack {error.name}: install this version of scissorcal "
                "where they run."
            ) from error
        except BrokenProcessPool as error:
            raise ScissorcalError(
                "A worker process was killed, most likely for want of memory. What was done is "
                "kept: run the same command again, with fewer --workers."
            ) from error
        finally:
            for future in running:
                future.cancel()

    @contextmanager
    def _connected(self) -> Iterator[None]:
        """Turn what a cluster raises within into a DeviceError; its jobs' own errors are text."""
        try:
            yield
        except Exception as error:
            sentence = _why_cluster_failed(error) if self.remote else ""
            if not sentence:
                raise
            raise DeviceError(
                f"{sentence}, and run the same command again: 'scissorcal verify' and 'scissorcal "
                "bench trade' go on from what was finished."
            ) from error


def _why_cluster_failed(error: Exception) -> str:
    """What of a cluster failed, and what to do first; empty where the error is of another kind.

    dask is not imported for the names of its errors, which are of no common kind.
    """
    name = type(error).__name__
    if name == "KilledWorker":
        return (
            "A job ended each worker of the cluster that it was given to, most likely for want of "
            "memory. Start workers with more memory or fewer at a time"
        )
    if isinstance(error, CancelledError | OSError) or name == "ClosedClientError":
        return (
            "The cluster ended while it worked: its scheduler was stopped, or the network to it "
            "failed. Start it again"
        )
    return ""


@lru_cache(maxsize=2)
def unpacked(blob: bytes) -> Any:
    """What many jobs share, as `pickle` packed it: a worker unpacks it once."""
    return pickle.loads(blob)


@contextmanager
def open_pool(processes: Processes) -> Iterator[Pool]:
    """Open processes of this machine, or the dask.distributed cluster at an address.

    One worker is this process
    itself. Processes are started afresh, with one thread of linear algebra each, and end when this
    one does, whatever ends it. Raises InputError where the cluster cannot be reached.
    """
    if processes.cluster is not None:
        with _cluster(processes.cluster) as pool:
            yield pool
        return
    count = processes.workers or usable_cores()
    if count == 1:
        with _left_alone():
            yield Pool(_Here(), 1, ahead=1)
        return
    context = multiprocessing.get_context("spawn")
    with (
        _single_threaded(),
        ProcessPoolExecutor(count, mp_context=context, initializer=_begin_worker) as executor,
    ):
        try:
            yield Pool(executor, count)
        except BaseException:
            executor.shutdown(wait=True, cancel_futures=True)
            raise


def usable_cores() -> int:
    """Processor cores that this process may use; all of them where the system does not tell."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def _left_alone() -> Iterator[None]:
    """What is there before the first job is not searched again by the collection after each."""
    is_first = not gc.get_freeze_count()  # what somebody else froze stays frozen
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        if is_first:
            gc.unfreeze()


class _End:
    pass


_END = _End()


class _Here(Executor):
    """Runs each job at once, in this thread."""

    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        future: Future[R] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - handed on to the caller
            future.set_exception(error)
        gc.collect()  # a fit leaves cycles of large arrays, and a command collects seldom
        return future


@contextmanager
def _cluster(address: str) -> Iterator[Pool]:
    try:
        distributed: Any = import_module("dask.distributed")
    except ImportError as error:
        raise needs_extra("--cluster", "dask.distributed", "cluster") from error
    if address.startswith("tls:") and not distributed.Security().tls_ca_file:
        raise InputError(
            f"{address} asks for TLS, and dask knows no certificates: name them in its "
            "configuration, as docs/cluster.md shows."
        )
    for handler in logging.getLogger("distributed").handlers:
        handler.addFilter(_without_traceback)
    try:
        client = distributed.Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"No dask scheduler answers at {address}: start one with 'dask scheduler' and workers "
            "with 'dask worker ADDRESS --nthreads 1', then give its address, such as "
            "tcp://host:8786."
        ) from error
    try:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise InputError(
                f"The cluster at {address} has no workers: start some with 'dask worker {address} "
                "--nthreads 1', where scissorcal is installed."
            )
        with client.get_executor(pure=False) as executor:
            yield Pool(executor, threads, remote=True)
    finally:
        client.close()


def _without_traceback(record: logging.LogRecord) -> bool:
    """Keep a line of dask's that has words; the errors that it logs are raised here, too."""
    record.exc_info = record.exc_text = None
    return bool(record.getMessage().strip())


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Let processes started meanwhile use one thread for linear algebra each."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


REMEDY = "Check that its workers have this version of scissorcal, and who may reach it."

_ERRORS = {
    kind.__name__: kind
    for kind in (
        ScissorcalError,
        errors.InputError,
        errors.VerdictError,
        errors.DeviceError,
        errors.MissingError,
    )
}


def answering(job: Callable[[T], Any]) -> Callable[[T], str]:
    """``job`` such that it answers with JSON text, whether it ends or raises."""
    return partial(_answer, job)


def read_answer(answer: object, kind: Any) -> Any:
    """The value of type ``kind`` in an answer; its type is checked as that of a foreign file.

    Raises the error that the answer tells of, ModuleNotFoundError where a worker lacks a module,
    and ScissorcalError where it is no answer.

    >>> read_answer(answering(abs)(-2), int)
    2
    """
    from pydantic import TypeAdapter, ValidationError

    if not isinstance(answer, str):
        raise ScissorcalError(f"The cluster sent no answer but {type(answer).__name__}. {REMEDY}")
    message = parse_json(answer, "The cluster's answer", REMEDY)
    if isinstance(message, dict) and "error" in message:
        raise _error(str(message["error"]), str(message.get("sentence", "")))
    try:
        return TypeAdapter(kind).validate_python(message["value"])
    except (ValidationError, KeyError, TypeError) as error:
        raise ScissorcalError(
            f"The cluster's answer is not of the kind that was asked for. {REMEDY}"
        ) from error


def _answer(job: Callable[[T], Any], item: T) -> str:
    from pydantic_core import to_jsonable_python

    try:
        return json.dumps({"value": to_jsonable_python(job(item))})
    except ModuleNotFoundError as error:
        return json.dumps({"error": "ModuleNotFoundError", "sentence": error.name or str(error)})
    except Exception as error:  # noqa: BLE001 - told to who asked, as text
        return json.dumps({"error": type(error).__name__, "sentence": str(error)})


def _error(name: str, sentence: str) -> Exception:
    if name == "ModuleNotFoundError":
        return ModuleNotFoundError(f"No module named {sentence!r}", name=sentence)
    if name in _ERRORS:
        return _ERRORS[name](sentence)
    return ScissorcalError(f"A worker of the cluster failed: {name}: {sentence}")
