/** Fetch what does not move: the map with its picture, and what the robot is made of. */

import { address, get } from "../api.js";
import { useEffect, useState } from "../ui.js";
import { loadPicture } from "./map_image.js";

/** Return the map `{origin_m, resolution_m, picture, places, keep_out}`, null until it is there. */
export function useFloor() {
  return useFetched(fetchFloor);
}

/** Return the robot's model, null until it is there. */
export function useModel() {
  return useFetched(fetchModel);
}

async function fetchFloor() {
  const map = await get("map");
  const response = await fetch(address("map.png"), { credentials: "same-origin" });
  if (!response.ok) throw new Error(`the map's picture: ${response.status}`);
  const [x_m, y_m] = map.origin ?? map.origin_m;
  return { ...map, origin_m: [x_m, y_m], picture: await loadPicture(await response.blob()) };
}

function fetchModel() {
  return get("robot/model");
}

function useFetched(fetchIt) {
  const [told, setTold] = useState({ data: null, error: null });
  useEffect(() => {
    let wanted = true;
    fetchIt().then(
      (data) => wanted && setTold({ data, error: null }),
      (error) => wanted && setTold({ data: null, error }),
    );
    return () => {
      wanted = false;
    };
  }, [fetchIt]);
  return told;
}
