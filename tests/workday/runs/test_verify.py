"""The verification of a workspace: resumable, the same for any number of workers, never mixed."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from concurrent.futures import Executor, Future
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from scissorcal.calibration import VerifyResult, load, save
from scissorcal.errors import InputError, MissingError
from scissorcal.foreign import RECORDS
from scissorcal.recipe import schemas_dir
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import Processes, VerifySettings
from scissorcal.workday.plan import make_plan
from scissorcal.workday.pool import open_pool
from scissorcal.workday.records import RecordFile
from scissorcal.workday.runs.fit import fit_workspace
from scissorcal.workday.runs.report import write_workspace_report
from scissorcal.workday.runs.verify import verify_workspace
from scissorcal.workday.workspace import Workspace
from tests.guard import GUARD_S
from tests.workday.made import fitted_workspace, quick_workspace, record_friction

FEW = VerifySettings(fits=4)


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return fitted_workspace(
        tmp_path_factory.mktemp("verify") / "paper", "friction", effort="standard"
    )


@pytest.fixture(scope="module")
def whole(fitted: Workspace) -> VerifyResult:
    (outcome,) = verify_workspace(fitted, ("friction",), FEW, processes=Processes(1))
    assert outcome.fitted == 7
    return outcome.result


@pytest.fixture
def cleared(fitted: Workspace, whole: VerifyResult) -> Workspace:
    """The same workspace without what an earlier check left there."""
    for path in (fitted.root / "fits").glob("friction.verify*"):
        path.unlink()
    return fitted


def without_times(result: VerifyResult) -> dict[str, Any]:
    assert result.calibration is not None
    return asdict(replace(result, calibration=replace(result.calibration, seconds=0.0)))


def test_a_check_holds_all_three_parts_and_keeps_its_schema(
    fitted: Workspace, whole: VerifyResult, cleared: Workspace
) -> None:
    names = ("inertia", "offset", "coulomb", "viscous", "effort_rms")
    assert whole.calibration is not None
    assert tuple(quantity.name for quantity in whole.calibration.quantities) == names
    assert all(len(quantity.ranks) == 4 for quantity in whole.calibration.quantities)
    assert whole.halves is not None
    assert not set(whole.halves.first_strokes) & set(whole.halves.second_strokes)
    assert whole.sensitivity is not None
    assert [row.name for row in whole.sensitivity.rows] == list(names)
    status = {verdict.check: verdict.status for verdict in whole.verdicts}
    assert status == {
        "calibration": "not_evaluated",
        "refits": "pass",
        "halves": "pass",
        "halves-effort": "pass",
        "prior": "pass",
    }, [verdict.why for verdict in whole.verdicts]
    assert {row.diagnosis for row in whole.sensitivity.rows} == {"fine"}
    path = Engine.of(cleared).file("verify friction")
    save(whole, path)
    assert load(path, VerifyResult) == whole
    schema = json.loads((schemas_dir() / "verify.schema.json").read_text(encoding="utf-8"))
    jsonschema.validate(json.loads(path.read_text(encoding="utf-8")), schema)


def test_a_report_is_stale_once_its_check_is_another_or_gone(
    cleared: Workspace, whole: VerifyResult
) -> None:
    """A check of more fits, of the same seed, is another one."""
    path = Engine.of(cleared).file("verify friction")
    save(whole, path)
    assert Engine.of(cleared).state("fit friction").state == "unverified", "four fits are too few"
    judged = [
        replace(v, status="pass", value=0.5) for v in whole.verdicts if v.check == "calibration"
    ]
    whole = replace(whole, verdicts=(*judged, *whole.verdicts[1:]))
    save(whole, path)
    write_workspace_report(Engine.of(cleared))
    assert Engine.of(cleared).state("report").state == "done"
    assert Engine.of(cleared).state("fit friction").state == "done"
    assert whole.calibration is not None
    longer = replace(whole, calibration=replace(whole.calibration, fits=400))
    save(longer, path)
    assert Engine.of(cleared).state("report").state == "stale"
    path.unlink()
    assert Engine.of(cleared).state("report").state == "stale"
    assert Engine.of(cleared).state("fit friction").state == "unverified"


@pytest.mark.slow
def test_two_workers_give_the_same_numbers(cleared: Workspace, whole: VerifyResult) -> None:
    (outcome,) = verify_workspace(cleared, ("friction",), FEW, processes=Processes(2))
    assert without_times(outcome.result) == without_times(whole)
    records = cleared.verify_partial_path("friction").read_text(encoding="utf-8").splitlines()
    assert len(records) == 1 + 7


def test_a_stopped_run_goes_on_and_a_larger_one_takes_what_is_there(
    cleared: Workspace, whole: VerifyResult
) -> None:
    class StoppedError(Exception):
        pass

    def stop(done: float, sentence: str) -> None:
        if sentence.startswith("friction: 4 of 7"):
            raise StoppedError

    with pytest.raises(StoppedError):
        verify_workspace(cleared, ("friction",), FEW, processes=Processes(1), progress=stop)
    partial = cleared.verify_partial_path("friction")
    with partial.open("ab") as stream:
        stream.write(b'{"kind": "simulated", "index": 3, "ra')
    (outcome,) = verify_workspace(cleared, ("friction",), FEW, processes=Processes(1))
    assert outcome.fitted == 3
    assert without_times(outcome.result) == without_times(whole)
    more = replace(FEW, fits=5)
    (outcome,) = verify_workspace(cleared, ("friction",), more, processes=Processes(1))
    assert outcome.fitted == 1
    assert outcome.result.calibration is not None
    assert whole.calibration is not None
    assert outcome.result.calibration.quantities[0].ranks[:4] == (
        whole.calibration.quantities[0].ranks
    )
    indices = [
        (record["kind"], record["index"])
        for record in map(json.loads, partial.read_text(encoding="utf-8").splitlines()[1:])
    ]
    assert len(set(indices)) == len(indices)


def test_a_check_that_comes_out_the_same_leaves_its_file(
    cleared: Workspace, whole: VerifyResult
) -> None:
    """A signature covers the file: one of an earlier version stays as it was signed."""
    verify_workspace(cleared, ("friction",), FEW, processes=Processes(1))
    path = cleared.root / "fits" / "friction.verify.json"
    earlier = path.read_bytes().replace(b'"candidate"', b'"rung"')
    assert b'"rung"' in earlier
    path.write_bytes(earlier)
    verify_workspace(cleared, ("friction",), FEW, processes=Processes(1))
    assert path.read_bytes() == earlier
    verify_workspace(cleared, ("friction",), replace(FEW, fits=3), processes=Processes(1))
    assert b'"rung"' not in path.read_bytes()


def test_records_of_another_seed_are_put_aside_with_a_word(cleared: Workspace) -> None:
    one = VerifySettings(fits=1, checks=("sbc",))
    verify_workspace(cleared, ("friction",), one, processes=Processes(1))
    (outcome,) = verify_workspace(
        cleared, ("friction",), replace(one, seed=1), processes=Processes(1)
    )
    assert outcome.fitted == 1
    (sentence,) = outcome.notes
    assert "made from other inputs" in sentence
    aside = cleared.root / "fits" / sentence.rsplit(" ", 1)[1].rstrip(".")
    assert len(aside.read_text(encoding="utf-8").splitlines()) == 2


def test_checks_that_are_not_asked_for_are_not_made(cleared: Workspace) -> None:
    only = VerifySettings(checks=("prior",))
    (outcome,) = verify_workspace(cleared, ("friction",), only, processes=Processes(1))
    assert outcome.fitted == 1
    assert (outcome.result.calibration, outcome.result.halves) == (None, None)
    assert [verdict.check for verdict in outcome.result.verdicts] == ["prior"]


def test_what_must_come_first_is_named(tmp_path: Path, fitted: Workspace) -> None:
    with pytest.raises(MissingError, match="scissorcal fit"):
        verify_workspace(quick_workspace(tmp_path / "empty"))
    with pytest.raises(MissingError, match="There is no fit of cut yet"):
        verify_workspace(fitted, ("cut",))


def test_the_plan_offers_a_check_until_there_is_one(tmp_path: Path) -> None:
    workspace = quick_workspace(tmp_path / "paper")
    recipe = workspace.recipe_path.read_text(encoding="utf-8")
    workspace.recipe_path.write_text(recipe.replace("[rig]", '[rig]\njoint = "linear"'), "utf-8")
    record_friction(workspace, recipe_toml="")
    assert Engine.of(workspace).state("fit friction").state == "missing"
    fit_workspace(workspace, ("friction",))
    unverified = Engine.of(workspace).state("fit friction")
    assert (unverified.state, unverified.command) == ("unverified", "scissorcal verify friction")
    verify_workspace(workspace, (), VerifySettings(checks=("prior",)), processes=Processes(1))
    check = Engine.of(workspace).state("verify friction")
    assert (check.state, check.found) == ("incomplete", "prior; coverage was not counted")
    assert Engine.of(workspace).state("fit friction").state == "unverified"
    assert make_plan(workspace).next_command == "scissorcal report"


def test_one_run_at_a_time(cleared: Workspace) -> None:
    path = cleared.verify_partial_path("friction")
    with RecordFile(path, "x"), pytest.raises(InputError, match="another run"):
        verify_workspace(cleared, ("friction",), FEW, processes=Processes(1))


def test_a_damaged_result_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "friction.verify.json"
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=r"friction\.verify\.json is not a verification"):
        load(path, VerifyResult)


def test_an_unreachable_cluster_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    with (
        pytest.raises(InputError, match=r"No dask scheduler answers at nonsense://1"),
        open_pool(Processes(cluster="nonsense://1")),
    ):
        pass
    with (
        pytest.raises(InputError, match=r"tls://127.0.0.1:1 asks for TLS, and dask knows no"),
        open_pool(Processes(cluster="tls://127.0.0.1:1")),
    ):
        pass
    monkeypatch.setitem(sys.modules, "dask.distributed", None)
    with (
        pytest.raises(InputError, match=r"pip install 'scissorcal\[cluster\]'"),
        open_pool(Processes(cluster="tcp://127.0.0.1:1")),
    ):
        pass


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_gives_the_same_numbers(cleared: Workspace, whole: VerifyResult) -> None:
    """A real scheduler with two worker processes, spoken to by its address."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        (outcome,) = verify_workspace(
            cleared, ("friction",), FEW, Processes(cluster=cluster.scheduler_address)
        )
    assert outcome.fitted == 7
    assert without_times(outcome.result) == without_times(whole)


KILLED = """
import sys
from pathlib import Path
from scissorcal.workday.options import Processes, VerifySettings
from scissorcal.workday.runs.verify import verify_workspace
from scissorcal.workday.workspace import Workspace
if __name__ == "__main__":
    many = VerifySettings(fits=500)
    verify_workspace(Workspace(Path(sys.argv[1])), ("friction",), many, processes=Processes(2))
"""


@pytest.mark.slow
def test_a_killed_run_loses_nothing_and_leaves_no_worker(
    cleared: Workspace, whole: VerifyResult, tmp_path: Path
) -> None:
    program = tmp_path / "killed.py"
    program.write_text(KILLED, encoding="utf-8")
    running = subprocess.Popen([sys.executable, str(program), str(cleared.root)])
    partial = cleared.verify_partial_path("friction")
    while not partial.is_file() or len(partial.read_bytes().splitlines()) < 6:
        assert running.poll() is None
        time.sleep(0.05)
    children = children_of(running.pid)
    assert len(children) >= 2
    running.send_signal(signal.SIGKILL)
    running.wait()
    before = [line for line in partial.read_bytes().splitlines(keepends=True) if b"\n" in line]
    (outcome,) = verify_workspace(cleared, ("friction",), FEW, processes=Processes(1))
    assert partial.read_bytes().splitlines(keepends=True)[: len(before)] == before
    assert outcome.fitted <= 7 - 5 + 1
    assert without_times(outcome.result) == without_times(whole)
    deadline = time.monotonic() + GUARD_S
    while any(is_running(pid) for pid in children) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(is_running(pid) for pid in children)


def children_of(pid: int) -> list[int]:
    path = Path(f"/proc/{pid}/task/{pid}/children")
    if not path.is_file():
        pytest.skip("the system does not tell a process's children")
    return [int(word) for word in path.read_text().split()]


def is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"


def test_what_a_worker_raises_comes_through_and_a_dead_one_is_told() -> None:
    from scissorcal.errors import ScissorcalError

    with open_pool(Processes(2)) as pool:
        found: list[int] = []
        pool.work(abs, [-3, 2, -1, 0, 5, -6], found.append, int)
        assert sorted(found) == [0, 1, 2, 3, 5, 6]
        with pytest.raises(ZeroDivisionError):
            pool.work(_divide, [1, 0, 2], found.append, float)
    with pytest.raises(ScissorcalError, match="fewer --workers"), open_pool(Processes(2)) as pool:
        pool.work(os._exit, [1], found.append, int)  # type: ignore[arg-type]


def _divide(by: int) -> float:
    return 1 / by


def test_records_that_are_not_kept_are_gone(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    with RecordFile(path, "one") as file:
        for value in range(3):
            file.append({"value": value})
        file.keep(file.records[1:2])
        with pytest.raises(InputError, match="another run"), RecordFile(path, "one"):
            pass
        file.append({"value": 7})
        assert file.records == [{"value": 1}, {"value": 7}]
    with RecordFile(path, "one") as file:
        assert file.records == [{"value": 1}, {"value": 7}]
    assert list(tmp_path.iterdir()) == [path]


def test_records_survive_a_torn_header(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    path.write_bytes(b'{"format": "scissor')
    with RecordFile(path, "one") as file:
        assert file.records == []
        assert "kept as a.jsonl.unreadable" in file.note
        file.append({"value": 1.5})
    with RecordFile(path, "one") as file:
        records: list[Mapping[str, Any]] = file.records
        assert records == [{"value": 1.5}]
        with pytest.raises(ValueError, match="not JSON compliant"):
            file.append({"value": np.nan})


@pytest.mark.parametrize("inputs", [b'["../../x"]', b'"../../../"', b'"a\\u0000b"', b"7" * 5000])
def test_records_of_a_strange_hash_are_put_aside_here(tmp_path: Path, inputs: bytes) -> None:
    path = tmp_path / "a.jsonl"
    path.write_bytes(b'{"format":"scissorcal-records/1","inputs":%s}\n' % inputs)
    with RecordFile(path, "one") as file:
        assert file.records == []
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.jsonl", "a.jsonl.unreadable"]


def test_what_is_no_file_holds_no_records(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.jsonl")
    (tmp_path / "device.jsonl").symlink_to("/dev/zero")
    with (tmp_path / "large.jsonl").open("wb") as large:
        large.truncate(RECORDS.most_bytes + 1)
    for name, words in (("pipe", "named pipe"), ("device", "a device"), ("large", "another file")):
        with pytest.raises(InputError, match=words), RecordFile(tmp_path / f"{name}.jsonl", "one"):
            pass


DYING = """
import subprocess, sys
from scissorcal.errors import DeviceError
from scissorcal.workday.options import Processes
from scissorcal.workday.pool import open_pool
if __name__ == "__main__":
    words = ("distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard")
    scheduler = subprocess.Popen([sys.executable, "-m", *words], stderr=subprocess.PIPE, text=True)
    address = next(line.split()[-1] for line in scheduler.stderr if "Scheduler at:" in line)
    words = ("distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny")
    worker = subprocess.Popen(
        [sys.executable, "-m", *words, "--no-dashboard"], stderr=subprocess.PIPE, text=True
    )
    next(line for line in worker.stderr if "Registered to" in line)
    found = []

    def finished(value):
        found.append(value)
        if len(found) == int(sys.argv[1]):
            scheduler.kill()

    try:
        with open_pool(Processes(cluster=address)) as pool:
            pool.work(abs, range(-40, 0), finished, int)
        print("whole", len(found))
    except DeviceError as error:
        print(error.exit_code, len(found) < 40, error)
    finally:
        worker.kill()
        scheduler.kill()
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("after", "words"), [("2", "4 True The cluster ended while it worked"), ("40", "whole 40")]
)
def test_a_scheduler_that_dies_is_a_sentence(tmp_path: Path, after: str, words: str) -> None:
    pytest.importorskip("distributed")
    program = tmp_path / "dying.py"
    program.write_text(DYING, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(program), after], capture_output=True, text=True, timeout=4 * GUARD_S
    )
    assert words in done.stdout, done.stderr
    assert "Traceback" not in done.stderr


def test_a_cluster_that_ends_is_told_as_one() -> None:
    from scissorcal.errors import DeviceError
    from scissorcal.workday.pool import Pool

    class Ended(Executor):
        def submit(self, *_: Any, **__: Any) -> Any:
            future: Future[Any] = Future()
            future.cancel()
            future.set_running_or_notify_cancel()
            return future

    found: list[int] = []
    with pytest.raises(DeviceError, match="The cluster ended while it worked"):
        Pool(Ended(), 1, remote=True).work(abs, [1, 2], found.append, int)
    assert found == []


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("ClosedClientError", "The cluster ended while it worked"),
        ("KilledWorker", "Start workers with more memory"),
    ],
)
@pytest.mark.parametrize("at_once", [True, False])
def test_a_cluster_that_fails_is_told_as_what_failed(name: str, said: str, at_once: bool) -> None:
    """dask's own errors, whether a job is handed in or its answer is awaited."""
    from scissorcal.errors import DeviceError
    from scissorcal.workday.pool import Pool

    fault = type(name, (Exception,), {})("tcp://127.0.0.1:1")

    class Failing(Executor):
        def submit(self, *_: Any, **__: Any) -> Any:
            if at_once:
                raise fault
            future: Future[Any] = Future()
            future.set_exception(fault)
            return future

    with pytest.raises(DeviceError, match=said):
        Pool(Failing(), 1, remote=True).work(abs, [1], [].append, int)
    with pytest.raises(type(fault)):
        Pool(Failing(), 1).work(abs, [1], [].append, int)
