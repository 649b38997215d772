"""What stands in the wiring drawings of the three builds; pins are those of firmware/boards."""

from benchmarks.drawings.builds import Wiring

OPEN_STOP = ("the open stop: the blades", "are driven to it slowly")
COURSE = Wiring(
    title="Wiring of the course build (firmware/boards/stm32f405.c)",
    supply=["12 V, 2 A,", "fuse 2 A, slow"],
    driver=["bridge with two inputs:", "both low free, both high brake"],
    motor=["coreless, 12 V,", "23.4 mN m/A, 2.2 ohm"],
    current=["INA240A2 and 20 mohm in the", "motor's lead: 1 V/A, 1.65 V at 0"],
    controller=[
        "STM32F405 board, 3.3 V",
        "PA5 supply, divider 50k and 10k",
        "PA6 temperature, TMP36",
    ],
    encoder=["AMT102, 512 lines, 5 V;", "its lines divided to 3.3 V"],
    home=OPEN_STOP,
    computer=["USB isolator,", "serial adapter of 3.3 V,", "921600 baud"],
    to_driver="PA8, PA9; fault PC1",
    from_current="PA4",
    from_encoder="PA0, PA1",
    from_stop="PC0, opens",
    to_computer="PC6, PC7",
    force=[
        "load cell of 50 N at the finger ring, instrumentation",
        "amplifier, 1 kHz: 33 mV/N about 1.65 V",
    ],
    from_force="PA7",
)
LAB = Wiring(
    title="Wiring of the lab build (firmware/boards/b_g431b_esc1.c)",
    supply=["12 V, 5 A,", "fuse 4 A, slow"],
    driver=["in the B-G431B-ESC1:", "outputs U and V, W stays open"],
    motor=["coreless, 12 V,", "23.4 mN m/A, 2.2 ohm"],
    current=["in the B-G431B-ESC1: 3 mohm,", "27 mV/A, 24 readings a tick"],
    controller=["B-G431B-ESC1, STM32G431", "PA0 supply, on the board", "24 kHz, one board a motor"],
    encoder=["AMT102, 512 lines, 5 V,", "on J8: A, B"],
    home=OPEN_STOP,
    computer=["USB isolator, the board's", "ST-LINK,", "921600 baud"],
    to_driver="on the board",
    from_current="PA2",
    from_encoder="PB6, PB7",
    from_stop="PB8 (J8: Z)",
    to_computer="PB3, PB4",
)
BEST = Wiring(
    title="Wiring of the best build (firmware/boards/teensy41.c)",
    supply=["+15 V and -15 V, 6 A,", "linear, fuses 6.3 A, slow"],
    driver=["OPA549 as current source,", "current limit set to 5 A"],
    motor=["ironless, 30 V type,", "38.9 mN m/A, 1.2 ohm"],
    current=["INA240A1 and 15 mohm in the", "motor's lead: 0.3 V/A"],
    controller=[
        "Teensy 4.1, 3.3 V",
        "A1 supply, divider 50k and 10k",
        "every input within 0 to 3.3 V",
    ],
    encoder=["optical, 5000 lines, 5 V;", "its lines divided to 3.3 V"],
    home=OPEN_STOP,
    computer=["USB isolator of 480 Mbit/s,", "no baud rate"],
    to_driver="set value; fault 7",
    from_current="A0",
    from_encoder="2, 3",
    from_stop="6, opens",
    to_computer="USB",
    force=[
        "load cell of 50 N at the finger ring, instrumentation",
        "amplifier, 1 kHz: 33 mV/N about 1.65 V",
    ],
    from_force="A2",
)
