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

// Factors of a Planckian radiator, 1667..25000 K, chromaticity by the cubic fit of Kim et al. (US patent 7024034),
// relative to D65 white; luminance factor 1, so that lux stay as measured. Negative components are cut off.
export function fromTemperature(kelvin) {
    const t = kelvin;
    const x = t < 4000 ? -0.2661239e9 / t ** 3 - 0.2343589e6 / t ** 2 + 0.8776956e3 / t + 0.17991
        : -3.0258469e9 / t ** 3 + 2.1070379e6 / t ** 2 + 0.2226347e3 / t + 0.24039;
    const y = t < 2222 ? -1.1063814 * x ** 3 - 1.3481102 * x ** 2 + 2.18555832 * x - 0.20219683
        : t < 4000 ? -0.9549476 * x ** 3 - 1.37418593 * x ** 2 + 2.09137015 * x - 0.16748867
            : 3.081758 * x ** 3 - 5.8733867 * x ** 2 + 3.75112997 * x - 0.37001483;
    const X = x / y, Z = (1 - x - y) / y;
    const rgb = [3.2406 * X - 1.5372 - 0.4986 * Z, -0.9689 * X + 1.8758 + 0.0415 * Z, 0.0557 * X - 0.204 + 1.057 * Z]
        .map((value) => Math.max(0, value));
    const luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    return rgb.map((value) => value / luminance);
}
