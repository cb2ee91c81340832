/** List the charts over time: which metric, how it is written, and whose lines it has. Pure. */

/**
 * Each row is a chart. `metric` names series of the history, `by` the label that tells its curves
 * apart, `line` the metric of the budget whose limits it is held against, `reading` the reading of
 * the computer whose absence is told with its reason. The history holds counters as their rates.
 */
export const CHARTS = [
  { title: "CPU by process", metric: "vla_process_cpu_cores", by: "process", unit: "cores", digits: 2, line: "cpu_ratio" },
  { title: "Memory by process", metric: "vla_process_memory_bytes", by: "process", unit: "MB", digits: 0, scale: 1e-6, line: "memory_mb" },
  { title: "CPU of the computer", metric: "vla_cpu_used_ratio", unit: "%", digits: 0, scale: 100, reading: "cpu_ratio" },
  { title: "Memory available", metric: "vla_memory_available_bytes", unit: "MB", digits: 0, scale: 1e-6, reading: "memory_available_bytes" },
  { title: "GPU", metric: "vla_gpu_load_ratio", unit: "%", digits: 0, scale: 100, reading: "gpu_load_ratio" },
  { title: "GPU memory", metric: "vla_gpu_memory_used_bytes", unit: "MB", digits: 0, scale: 1e-6, line: "gpu_memory_mb", reading: "gpu_memory_used_bytes" },
  { title: "Power", metric: "vla_power_watts", unit: "W", digits: 1, line: "power_w", reading: "power_w" },
  { title: "Temperature", metric: "vla_temperature_celsius", unit: "°C", digits: 1, line: "temperature_c", reading: "temperature_c" },
  { title: "Disk free", metric: "vla_disk_free_bytes", unit: "MB", digits: 0, scale: 1e-6, line: "disk_free_mb", reading: "disk_free_bytes" },
  { title: "Late ticks of control", metric: "vla_control_late_ticks_total", unit: "per s", digits: 2 },
];

const TOTAL = "total";
const COLOURS = 8;

/** Return the limit of one curve, or undefined; `budget` is the live document. */
export function limitOf(chart, label, budget) {
  if (!chart.line || !budget) return undefined;
  const process = chart.by && label !== TOTAL ? label : null;
  return budget.rows.find((row) => row.metric === chart.line && row.process === process)?.limit;
}

/** Return why a chart has nothing to show, or "" when it should have. */
export function missingReason(chart, board, history) {
  return board?.missing?.[chart.reading] ?? history?.missing?.[chart.metric] ?? "";
}

/** Return the curves of a chart, as it is written, each with the number of its colour. */
export function curvesOf(chart, history) {
  const told = history?.series.get(chart.metric) ?? [];
  const known = told.filter(({ values }) => values.some((value) => value !== null));
  return known.map(({ label, times_s, values }, at) => {
    const scaled = chart.scale ? values.map((value) => (value === null ? null : value * chart.scale)) : values;
    return { label, times_s, values: scaled, colour: (at % COLOURS) + 1 };
  });
}
