// Colours of a light: scene-linear Rec.709 factors on the wire, sRGB in the browser's picker.

const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const decode = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

// Factors above 1 are shown as the colour they have, at full brightness.
export function toHex(rgb) {
    const peak = Math.max(1, ...rgb);
    return `#${rgb.map((x) => Math.round(255 * encode(Math.max(0, x / peak))).toString(16).padStart(2, "0")).join("")}`;
}

export function fromHex(hex) {
    return [1, 3, 5].map((at) => decode(parseInt(hex.slice(at, at + 2), 16) / 255));
}
