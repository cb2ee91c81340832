/** Say how old a live value may be before the page shows it as stale, in seconds. */

const USUAL_S = 3;

// Ages on the robot are judged there, to the millisecond; these add the way to the browser.
const DEADLINES_S = {
  joint_state: 1,
  base_state: 1,
  base_command: 1,
  control_status: 1,
  pose: 1.5,
  scan: 1.5,
  near_obstacles: 2,
  live_obstacles: 2,
  scene: 3,
  camera: 3,
  executor_status: 2,
  planner_status: 3,
  speech_status: 3,
  process_table: 4,
  activity: 4,
  profile_status: 4,
  budget: 4,
  battery: 5,
  topics: 4,
  path: 4,
  missions: Infinity, // told on change, as alarms are
  alarms: Infinity,
};

/** Return the deadline of a topic. */
export function deadlineOf(topic) {
  return DEADLINES_S[topic] ?? USUAL_S;
}
