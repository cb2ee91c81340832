/** Turn the numbers of `joint_state` into rows for people: degrees, millimetres, words. */

const DEGREES = 180 / Math.PI;

// Bits of the servos' hardware error register (address 70 of Dynamixel X).
const ERROR_WORDS = [
  [1 << 0, "input voltage"],
  [1 << 2, "overheating"],
  [1 << 3, "encoder"],
  [1 << 4, "electrical shock"],
  [1 << 5, "overload"],
];

// How a kind of joint is written: factor from SI, unit, digits.
const WRITING = {
  hinge: { factor: DEGREES, unit: "°", rate: "°/s", digits: 1 },
  slide: { factor: 1000, unit: "mm", rate: "mm/s", digits: 1 },
};

// From these shares of the stall torque on, effort is told in colour.
const EFFORT_TONES = [
  [0.85, "bad"],
  [0.6, "warn"],
];

/** Return what the set bits of an error register mean. */
export function errorWords(bits) {
  const known = ERROR_WORDS.filter(([bit]) => bits & bit);
  const rest = bits & ~ERROR_WORDS.reduce((sum, [bit]) => sum | bit, 0);
  return [...known.map(([, words]) => words), ...(rest ? [`unknown bits 0x${rest.toString(16)}`] : [])];
}

/** Return the tone of an effort as a share of the stall torque. */
export function effortTone(ratio) {
  return EFFORT_TONES.find(([least]) => Math.abs(ratio) >= least)?.[1] ?? "";
}

/** Return each joint of the robot's model by its name: {kind, range}. */
export function jointsByName(model) {
  const joints = (model?.links ?? []).flatMap((link) => link.joints ?? []);
  return new Map(joints.map((joint) => [joint.name, joint]));
}

/** Return a row for each joint; `joints` by name tell kind and range, `slow` of
 * `control_status` what servos tell now and then. */
export function rowsOf(state, joints, slow = {}) {
  return state.names.map((name, at) => {
    const joint = joints.get(name) ?? {};
    const writing = WRITING[joint.kind] ?? WRITING[name.includes("gripper") ? "slide" : "hinge"];
    return {
      name,
      writing,
      position: state.position[at],
      setpoint: state.setpoint[at],
      velocity: state.velocity[at],
      effort_ratio: state.effort_ratio[at],
      temperature_c: slow.temperature_c?.[at] ?? null,
      voltage_v: slow.voltage_v?.[at] ?? null,
      current_a: slow.current_a?.[at] ?? null,
      age_s: state.age_s?.[at] ?? null,
      torque: Boolean(state.torque_enabled[at]),
      errors: errorWords(state.error[at]),
      range: joint.range ?? null,
    };
  });
}

/** Return the share of its range at which a joint is, or null without a range. */
export function rangeRatio(value, range) {
  if (!range || range[1] <= range[0]) return null;
  return Math.min(Math.max((value - range[0]) / (range[1] - range[0]), 0), 1);
}

/** Return a joint's value as text. */
export function written(value, { factor, digits }) {
  if (!Number.isFinite(value)) return "–";
  const text = (value * factor).toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text; // no "-0.0"
}
