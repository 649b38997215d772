"""A device on an STM32F405, as far as its firmware sees it: registers, a motor, blades with stops.

Written from RM0090 and the wiring in firmware/boards/stm32f405.c, and only what that file uses.
Time passes by ticks: each wait for TIM6 ends at once.
"""

from dataclasses import dataclass, field

from scissorcal.kernel import FrameDecoder, Message, decode
from tests.firmware.elf import Image
from tests.firmware.emulator import Processor

RCC_CR, RCC_CFGR = 0x40023800, 0x40023808
GPIOC_IDR = 0x40020810
TIM1, TIM2_CNT, TIM5_CNT, TIM6_SR = 0x40010000, 0x40000024, 0x40000C24, 0x40001010
TIM1_CCR1, TIM1_CCR2, TIM1_BDTR, TIM1_ARR = TIM1 + 0x34, TIM1 + 0x38, TIM1 + 0x44, TIM1 + 0x2C
ADC1_SR, ADC1_CR2, ADC1_JSQR, ADC1_JDR = 0x40012000, 0x40012008, 0x40012038, 0x4001203C
DMA2 = 0x40026400
RX_CR, RX_NDTR, RX_M0AR = DMA2 + 0x28, DMA2 + 0x2C, DMA2 + 0x34
TX_CR, TX_NDTR, TX_M0AR = DMA2 + 0xA0, DMA2 + 0xA4, DMA2 + 0xAC
IWDG_KR = 0x40003000
MAIN_OUTPUT = 1 << 15
ENABLED = 1
RUNNING, RELOAD = 0xCCCC, 0xAAAA

TICK_S = 1e-3
SUPPLY_V, RESISTANCE_ohm, TORQUE_PER_A = 12.0, 5.0, 0.2
INERTIA_kg_m2, DAMPING_N_m_s = 2e-4, 2e-3
RAD_PER_COUNT = 3.0679616e-4
STOPS_rad = (0.0, 1.05)
STEPS_PER_V = 4096 / 3.3


@dataclass
class Device:
    """The board with its motor; ``power_on`` runs the image until its first tick.

    ``opening`` (rad) and ``rate`` (rad/s) are the blades', ``current`` (A) the motor's, all as they
    are and not as the sensors give them. ``stop_button`` breaks its line; ``bridge_fault`` pulls
    its own.
    """

    opening: float = 0.6
    rate: float = 0.0
    current: float = 0.0
    stop_button: bool = False
    bridge_fault: bool = False
    watchdog: list[int] = field(default_factory=list)
    _words: dict[int, int] = field(default_factory=dict)
    _ticks: int = 0
    _zero: float = 0.6  # rad at which the encoder's count is 0: where the blades were at power-on

    def power_on(self, image: Image) -> "Device":
        self._zero = self.opening
        self.processor = Processor(image, (self._read, self._write))
        self._decoder = FrameDecoder()
        self._sent: list[bytes] = []
        self._line = b""
        self._ring_at = 0
        self.processor.call("loop_start")
        return self

    def tick(self, frames: bytes = b"") -> list[Message]:
        """Let the host's bytes arrive and a tick pass; what the device sent in it."""
        self._arrive(frames)
        self._ticks += 1
        self._move()
        self.processor.call("loop_tick")
        sent, self._sent = b"".join(self._sent), []
        return [decode(payload) for payload in self._decoder.feed(sent)]

    @property
    def drive(self) -> float | None:
        """Voltage on the motor in V, None while the bridge's outputs are off."""
        if not self._words.get(TIM1_BDTR, 0) & MAIN_OUTPUT:
            return None
        top = self._words[TIM1_ARR] + 1
        first, second = (min(1.0, self._words[at] / top) for at in (TIM1_CCR1, TIM1_CCR2))
        return SUPPLY_V * (first - second)

    def _move(self) -> None:
        """The motor's winding settles within a tick; the blades move in ten steps of it."""
        volts = self.drive
        for _ in range(10):
            back = TORQUE_PER_A * self.rate
            self.current = 0.0 if volts is None else (volts - back) / RESISTANCE_ohm
            torque = TORQUE_PER_A * self.current - DAMPING_N_m_s * self.rate
            self.rate += torque / INERTIA_kg_m2 * TICK_S / 10
            self.opening += self.rate * TICK_S / 10
            if not STOPS_rad[0] < self.opening < STOPS_rad[1]:
                self.opening = min(max(self.opening, STOPS_rad[0]), STOPS_rad[1])
                self.rate = 0.0

    def _arrive(self, frames: bytes) -> None:
        """DMA writes what comes into its ring, round and round."""
        size = self._ring_bytes
        for byte in frames:
            self.processor.write(self._words[RX_M0AR] + self._ring_at, bytes([byte]))
            self._ring_at = (self._ring_at + 1) % size

    @property
    def _ring_bytes(self) -> int:
        return self._words[RX_NDTR]

    def _read(self, address: int) -> int:
        words = self._words
        if address == RCC_CR:  # what is switched on is ready at once
            on = words.get(address, 0)
            return on | (on & 1 << 16) << 1 | (on & 1 << 24) << 1
        if address == RCC_CFGR:
            return words.get(address, 0) | (words.get(address, 0) & 3) << 2
        if address == TIM6_SR:
            return 1
        if address == TIM5_CNT:
            return round(1e6 * TICK_S * self._ticks) & 0xFFFFFFFF
        if address == TIM2_CNT:
            return int((self.opening - self._zero) / RAD_PER_COUNT) & 0xFFFFFFFF
        if address == GPIOC_IDR:
            return int(self.stop_button) | int(not self.bridge_fault) << 1 | 1 << 2
        if address == ADC1_SR:
            return 1 << 2 if words.get(ADC1_CR2, 0) & 1 << 22 else 0
        if ADC1_JDR <= address < ADC1_JDR + 16:
            return self._converted((address - ADC1_JDR) // 4)
        if address == RX_NDTR:
            return self._ring_bytes - self._ring_at
        return words.get(address, 0)

    def _converted(self, rank: int) -> int:
        """Steps of the ADC for the channel that JSQR puts at this rank."""
        channel = self._words[ADC1_JSQR] >> 5 * rank & 31
        volts = {
            4: 1.65 + self.current,
            5: SUPPLY_V / 6.0,
            6: 0.5 + 0.01 * 25.0,
            7: 1.65,
        }[channel]
        return min(4095, max(0, round(volts * STEPS_PER_V)))

    def _write(self, address: int, value: int) -> None:
        if address == IWDG_KR:
            self.watchdog.append(value)
        self._words[address] = value
        if address == TX_CR and value & ENABLED:
            size, start = self._words[TX_NDTR], self._words[TX_M0AR]
            self._sent.append(self.processor.memory(start, size))
            self._words[TX_CR] = value & ~ENABLED  # sent within the tick
