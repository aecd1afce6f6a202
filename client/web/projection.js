// Where things of the scene are in the picture, and what of the scene lies under a place of it: server/scene/eye.h's
// camera. Pure functions. Places are 0..1 of the picture from its upper left corner, lengths metres.

export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const add = (a, b) => a.map((x, i) => x + b[i]);
export const scale = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => scale(a, 1 / Math.max(length(a), 1e-12));

// camera: {eye, target, fov_rad}, fov vertical. size_px: [width, height].
export function eyeOf({eye, target, fov_rad}, size_px) {
    const forward = unit(sub(target, eye));
    const right = unit(cross(forward, Math.abs(forward[1]) > 0.9999 ? [0, 0, -1] : [0, 1, 0]));
    const tanY = Math.tan(fov_rad / 2);
    return {position: eye, forward, right, up: cross(right, forward), tanX: tanY * size_px[0] / size_px[1], tanY};
}

// Result: {x, y, depth} of a point; null where it lies behind the camera.
export function project(eye, point) {
    const d = sub(point, eye.position), depth = dot(d, eye.forward);
    if (!(depth > 1e-6)) return null;
    return {x: 0.5 + 0.5 * dot(d, eye.right) / (depth * eye.tanX), y: 0.5 - 0.5 * dot(d, eye.up) / (depth * eye.tanY), depth};
}

// Result: the direction of the ray through a place, one metre deep.
export function rayThrough(eye, {x, y}) {
    return add(eye.forward, add(scale(eye.right, (2 * x - 1) * eye.tanX), scale(eye.up, (1 - 2 * y) * eye.tanY)));
}

// Result: where the ray meets the plane through a point; null where it runs along it or meets it behind the camera.
export function onPlane(eye, ray, point, normal) {
    const along = dot(ray, normal);
    if (Math.abs(along) < 1e-9) return null;
    const t = dot(sub(point, eye.position), normal) / along;
    return t > 0 ? add(eye.position, scale(ray, t)) : null;
}

// Result: the point of the line through `point` along the unit vector `axis` that is nearest to the ray; null where
// both run alike.
export function onAxis(eye, ray, point, axis) {
    const direction = unit(ray), across = sub(direction, scale(axis, dot(direction, axis)));
    const square = dot(across, across);
    if (square < 1e-6) return null;
    const off = sub(point, eye.position);
    const t = dot(off, across) / square;    // along the ray
    return add(point, scale(axis, dot(sub(scale(direction, t), off), axis)));
}
