/** Send the browser's microphone to the robot: PCM16, mono, while it is held open. */

const RATES_HZ = [16_000, 48_000];
const TAIL_MS = 400; // the end of the last word
const MOST_WAITING_BYTES = 64_000; // two seconds: what a network cannot carry is dropped, not delayed

/** Say why this browser gives no microphone, or "". */
export function whyNoMicrophone() {
  if (!window.isSecureContext) {
    return "Browsers give their microphone only to https pages and to this computer: set up TLS, see docs/dashboard.md.";
  }
  if (!navigator.mediaDevices?.getUserMedia || !window.AudioWorkletNode) {
    return "This browser has no microphone for pages.";
  }
  return "";
}

/** Open the microphone and send it; `onLevel` gets the loudness, 0 to 1; `onEnd` why it ended. */
export async function openMicrophone({ onLevel, onEnd }) {
  const stream = await navigator.mediaDevices.getUserMedia({
    audio: { channelCount: 1, echoCancellation: true, noiseSuppression: true, autoGainControl: true },
  });
  const context = await contextFor(stream);
  const socket = await openSocket(context.sampleRate);
  const node = new AudioWorkletNode(context, "speech-blocks");
  node.port.onmessage = ({ data: { level, samples } }) => {
    onLevel(level);
    const isFree = socket.bufferedAmount < MOST_WAITING_BYTES;
    if (isFree && socket.readyState === WebSocket.OPEN) socket.send(samples);
  };
  context.createMediaStreamSource(stream).connect(node);
  const close = () => {
    stream.getTracks().forEach((track) => track.stop());
    if (context.state !== "closed") context.close();
    socket.close();
  };
  socket.addEventListener("close", (event) => {
    close();
    onEnd(event.reason);
  });
  return { close: () => setTimeout(close, TAIL_MS) };
}

async function contextFor(stream) {
  for (const sampleRate of RATES_HZ) {
    const context = new AudioContext({ sampleRate });
    try {
      context.createMediaStreamSource(stream).disconnect(); // some browsers resample nothing
      await context.audioWorklet.addModule(new URL("speech_worklet.js", import.meta.url));
      return context;
    } catch (error) {
      await context.close();
      if (error.name !== "NotSupportedError") throw error;
    }
  }
  throw new Error(`the microphone gives none of ${RATES_HZ.join(", ")} Hz`);
}

function openSocket(rate_hz) {
  const url = new URL("api/v1/microphone", document.baseURI);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  const socket = new WebSocket(url);
  return new Promise((resolve, reject) => {
    socket.addEventListener("open", () => {
      socket.send(JSON.stringify({ rate_hz }));
      resolve(socket);
    });
    socket.addEventListener("close", (event) => reject(new Error(event.reason || "the robot takes no sound now")));
  });
}
