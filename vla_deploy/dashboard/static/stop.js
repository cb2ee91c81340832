/** Press stop at both doors at once: the dashboard's and the stop door's. */

const button = document.getElementById("stop-button");
const answer = document.getElementById("stop-answer");
const door = document.querySelector('meta[name="stop-door"]').content;

function doors() {
  const api = new URL("api/v1/stop", document.baseURI).href;
  return [api, door].filter(Boolean);
}

async function press() {
  answer.textContent = "Stopping …";
  const body = JSON.stringify({ reason: "pressed on the page" });
  const headers = { "Content-Type": "application/json" };
  try {
    await Promise.any(doors().map((url) => fetch(url, { method: "POST", headers, body }).then(checked)));
    answer.textContent = "Stop pressed.";
  } catch {
    answer.textContent = "Nobody answered: press the robot's own emergency stop.";
  }
}

function checked(response) {
  if (!response.ok) throw new Error(response.statusText);
}

button.addEventListener("click", press);
