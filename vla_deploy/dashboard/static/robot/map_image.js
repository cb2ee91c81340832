/** Colour the map's picture for the theme: what is free, blocked and unknown. */

const FREE_ABOVE = 230; // a shade: 0 black is blocked, 255 white is free, grey is unknown
const BLOCKED_BELOW = 120;

/** Return the map's picture as published, decoded. */
export async function loadPicture(blob) {
  const bitmap = await createImageBitmap(blob);
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, canvas.width, canvas.height);
}

/** Return a canvas with every cell in the colour of what it holds. */
export function coloured(picture, colours) {
  const canvas = new OffscreenCanvas(picture.width, picture.height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  const shades = [colours.wall, colours.unknown, colours.floor].map((colour) => bytes(context, colour));
  const painted = context.createImageData(picture.width, picture.height);
  for (let at = 0; at < picture.data.length; at += 4) {
    painted.data.set(shades[kindOf(picture.data[at])], at);
  }
  context.putImageData(painted, 0, 0);
  return canvas;
}

function kindOf(shade) {
  if (shade < BLOCKED_BELOW) return 0;
  return shade > FREE_ABOVE ? 2 : 1;
}

function bytes(context, colour) {
  context.clearRect(0, 0, 1, 1);
  context.fillStyle = colour;
  context.fillRect(0, 0, 1, 1);
  return context.getImageData(0, 0, 1, 1).data;
}
