/** Turn sound into blocks of PCM16 on the audio thread; it knows nothing of the page. */

const BLOCK_S = 0.04;

class SpeechBlocks extends AudioWorkletProcessor {
  #samples = new Int16Array(Math.round(BLOCK_S * sampleRate));
  #filled = 0;
  #peak = 0;

  process([[channel]]) {
    for (const value of channel ?? []) this.#take(Math.max(-1, Math.min(1, value)));
    return true;
  }

  #take(value) {
    this.#samples[this.#filled++] = Math.round(32_767 * value);
    this.#peak = Math.max(this.#peak, Math.abs(value));
    if (this.#filled === this.#samples.length) this.#send();
  }

  #send() {
    const samples = this.#samples.slice().buffer;
    this.port.postMessage({ level: this.#peak, samples }, [samples]);
    this.#filled = 0;
    this.#peak = 0;
  }
}

registerProcessor("speech-blocks", SpeechBlocks);
