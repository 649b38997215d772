"""The WebAssembly of the C core, run by wasmtime: what a page does, from Python."""

from typing import Any

import numpy as np
import wasmtime
from numpy.typing import NDArray

from scissorcal.kernel import STEP_DTYPE, ModelTables, Piece
from scissorcal.kernel.tables import TABLE_NAMES
from scissorcal.kernel.web_module import MODEL_NUMBERS, web_module, web_numbers

PLACE_DTYPE = np.dtype([("opening", "<f4"), ("rate", "<f4"), ("advance", "<f4")])


class WebModel:
    """One instance of the module with one model in it."""

    def __init__(self, tables: ModelTables) -> None:
        engine = wasmtime.Engine()
        self._store = wasmtime.Store(engine)
        module = wasmtime.Module(engine, web_module())
        assert not list(module.imports), "the module imports nothing, so that any host runs it"
        self._exports = wasmtime.Instance(self._store, module, []).exports(self._store)
        self._call("_initialize")
        self.most = self._call("sc_web_batch_max")
        for which, name in enumerate(TABLE_NAMES):
            table = getattr(tables, name)
            start = self._call("sc_web_table", which, len(table.x))
            for row, values in enumerate((table.x, table.y, table.slope)):
                offset = start + 4 * row * self._call("sc_web_table_max")
                self._memory(offset, len(values), np.dtype("<f4"))[:] = values
        assert len(web_numbers(tables)) == len(MODEL_NUMBERS)
        self.is_sound = self._call("sc_web_make", *web_numbers(tables))

    def reset(self, crack: float = 0.0) -> None:
        self._call("sc_web_reset", crack)

    @property
    def crack(self) -> float:
        return float(self._call("sc_web_crack"))

    def step_many(self, places: NDArray[np.void]) -> NDArray[np.void]:
        return self._batches("sc_web_steps", places)

    def torque(self, places: NDArray[np.void]) -> NDArray[np.float32]:
        return self._batches("sc_web_settled", places)["torque"]

    def place(self, *section: float) -> bool:
        return bool(self._call("sc_web_place", *section))

    def add(self, *pieces: Piece) -> list[bool]:
        """Add pieces with their strips; what the module answered to each call."""
        answers = []
        for piece in pieces:
            answers.append(self.begin(piece.begin_m, piece.upper_face_m, piece.scale))
            answers += [self.strip(s.end_m, s.fracture_energy_J_per_m) for s in piece.strips]
        return answers

    def begin(self, *numbers: float) -> bool:
        return bool(self._call("sc_web_piece_begin", *numbers))

    def strip(self, *numbers: float) -> bool:
        return bool(self._call("sc_web_piece_strip", *numbers))

    def clear(self) -> None:
        self._call("sc_web_pieces_clear")

    def piece_crack(self, which: int) -> float:
        return float(self._call("sc_web_piece_crack", which))

    def _batches(self, function: str, places: NDArray[np.void]) -> NDArray[np.void]:
        done = []
        for start in range(0, len(places), self.most):
            part = places[start : start + self.most]
            self._memory(self._call("sc_web_places"), len(part), PLACE_DTYPE)[:] = part
            self._call(function, len(part))
            done.append(self._memory(self._call("sc_web_outputs"), len(part), STEP_DTYPE).copy())
        return np.concatenate(done)

    def _call(self, name: str, *arguments: Any) -> Any:
        return self._exports[name](self._store, *arguments)

    def _memory(self, start: int, count: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        memory = self._exports["memory"]
        whole = memory.get_buffer_ptr(self._store)
        return np.ctypeslib.as_array(whole)[start : start + count * dtype.itemsize].view(dtype)
