/** Draw the icons: strokes on a field of 24, in the colour of the text. */

import { html } from "./ui.js";

const PATHS = {
  pulse: "M3 12h4l3-8 4 16 3-8h4",
  robot: "M5 9h14v10H5zM12 9V5M9 13.5v1.5M15 13.5v1.5M2.5 13v3M21.5 13v3",
  speech: "M4 5h16v11H9l-5 4z",
  gauge: "M4 18a9 9 0 1 1 16 0M12 14l4-5",
  bell: "M6 17V11a6 6 0 0 1 12 0v6l1.5 2h-15zM10.5 21h3",
  sliders: "M4 7h10M18 7h2M4 12h3M11 12h9M4 17h8M16 17h4M14 5v4M7 10v4M12 15v4",
  alert: "M12 4 2.5 20h19zM12 10v5M12 17.6v.2",
  check: "M4.5 12.5l5 5 10-11",
  cross: "M6 6l12 12M18 6 6 18",
  clock: "M12 3.5a8.5 8.5 0 1 0 .01 0M12 8v4.5l3 2",
  play: "M7 4.5v15l12-7.5z",
  pause: "M8 5v14M16 5v14",
  microphone: "M9 4.5a3 3 0 0 1 6 0V11a3 3 0 0 1-6 0zM5.5 11a6.5 6.5 0 0 0 13 0M12 17.5V21",
  send: "M4 12 20 4l-5 16-4-7z",
  question: "M9 9a3 3 0 1 1 4.5 2.6c-1 .6-1.5 1.2-1.5 2.4M12 17.4v.2",
  download: "M12 4v11M7.5 11l4.5 4.5L16.5 11M4.5 20h15",
  record: "M12 6a6 6 0 1 0 .01 0",
  shield: "M12 3l8 3v6c0 5-3.5 8-8 9.5-4.5-1.5-8-4.5-8-9.5V6z",
  power: "M12 3v8M7 6.5a7.5 7.5 0 1 0 10 0",
  reset: "M4 12a8 8 0 1 0 2.5-5.8M4 4v4.5h4.5",
  plug: "M9 3v5M15 3v5M6.5 8h11v3a5.5 5.5 0 0 1-11 0zM12 16.5V21",
  hand: "M8 12V6.5a1.5 1.5 0 0 1 3 0V11V4.5a1.5 1.5 0 0 1 3 0V11V6a1.5 1.5 0 0 1 3 0v8a6 6 0 0 1-11 3.3L4 14a1.6 1.6 0 0 1 2.6-1.8z",
  person: "M12 4a3.7 3.7 0 1 0 .01 0M4.5 20.5a7.5 7.5 0 0 1 15 0",
  sun: "M12 8a4 4 0 1 0 .01 0M12 2.5V5M12 19v2.5M2.5 12H5M19 12h2.5M5.3 5.3l1.7 1.7M17 17l1.7 1.7M18.7 5.3 17 7M7 17l-1.7 1.7",
  moon: "M19.5 14.5A8 8 0 1 1 9.5 4.5a6.5 6.5 0 0 0 10 10z",
  contrast: "M12 3.5a8.5 8.5 0 1 0 .01 0M12 3.5v17",
  leave: "M14 4H5v16h9M10 12h11M17.5 8l4 4-4 4",
  wifi: "M2.5 9a14 14 0 0 1 19 0M5.8 12.7a9 9 0 0 1 12.400 0M9 16.3a4.3 4.3 0 0 1 6 0M12 19.6v.2",
  skip: "M5 5l9 7-9 7zM18 5v14",
  chevron: "M8 5l8 7-8 7",
};

/** An icon that says nothing by itself: the words beside it do. */
export function Icon({ name }) {
  return html`
    <svg class="icon" viewBox="0 0 24 24" aria-hidden="true" focusable="false"><path d=${PATHS[name]} /></svg>
  `;
}
