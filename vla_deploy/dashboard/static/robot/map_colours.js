/** Name the colours of the map by what they show. */

/** Custom property of each colour; robot.css declares those of its own. */
export const MAP_COLOURS = {
  unknown: "--map-unknown",
  floor: "--map-floor",
  wall: "--map-wall",
  grid: "--map-grid",
  surface: "--map-surface",
  keepOut: "--bad",
  place: "--text-2",
  driven: "--map-driven",
  planned: "--accent",
  scan: "--map-scan",
  obstacle: "--map-obstacle",
  zone: "--map-zone",
  zoneActive: "--bad",
  robot: "--accent",
  robotNose: "--on-strong",
  doubt: "--accent",
  thing: "--series-4",
  bystander: "--warn",
  selected: "--accent",
  outline: "--text",
  text: "--text",
  halo: "--surface",
};

/** The colours of things, by the word that the robot has for them. */
export const THING_COLOURS = {
  red: "#d5352b",
  green: "#2e9e56",
  blue: "#2f6fd6",
  yellow: "#e3b51e",
  orange: "#e07b22",
  purple: "#8c4fc4",
  pink: "#dd6fa5",
  brown: "#8a5a3b",
  black: "#2a2d33",
  white: "#f4f4f2",
  grey: "#8d939c",
  gray: "#8d939c",
};
