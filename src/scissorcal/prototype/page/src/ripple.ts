// What a crack's runs can be heard and felt by: clicks, and the rumble of a gamepad.

const FULL_J = 2e-4; // of one frame, at which click and rumble are strongest
const RUMBLE_ms = 40;

export class Ripple {
  private context: AudioContext | null = null;
  private hasSound = false;
  private hasRumble = false;

  sound(isOn: boolean): void {
    this.hasSound = isOn;
    if (isOn) this.context ??= new AudioContext();
  }

  rumble(isOn: boolean): void {
    this.hasRumble = isOn;
  }

  /** Energy (J) that cracks released since the last frame, and the torque as a share of the largest. */
  released(energy: number, load: number): void {
    const strength = Math.min(Math.sqrt(energy / FULL_J), 1);
    if (strength < 0.05) return;
    if (this.hasSound && this.context) click(this.context, strength);
    if (!this.hasRumble) return;
    for (const pad of navigator.getGamepads()) {
      void pad?.vibrationActuator?.playEffect("dual-rumble", {
        duration: RUMBLE_ms, strongMagnitude: strength, weakMagnitude: Math.min(Math.max(load, 0), 1),
      });
    }
  }
}

function click(context: AudioContext, strength: number): void {
  const length = Math.round(0.012 * context.sampleRate);
  const buffer = context.createBuffer(1, length, context.sampleRate);
  const values = buffer.getChannelData(0);
  for (let i = 0; i < length; i++) values[i] = 0.4 * strength * (2 * Math.random() - 1) * Math.exp((-6 * i) / length);
  const source = context.createBufferSource();
  source.buffer = buffer;
  source.connect(context.destination);
  source.start();
}
