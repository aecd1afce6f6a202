// A picture's pixels and the grid of points among them for SIMD lanes: four vectors of pixels 4 apart at a time.
// Included after simd.h and as it is.

HWY_INLINE Vec3 position_of(const Points& points, std::ptrdiff_t at) {
    return {load(points.x + at), load(points.y + at), load(points.z + at)};
}
HWY_INLINE Vec3 normal_of(const Points& points, std::ptrdiff_t at) {
    return {load(points.nx + at), load(points.ny + at), load(points.nz + at)};
}
// Columns first, first + 4, ...
HWY_INLINE Float column_of(std::size_t first) {
    const Tag tag;
    return hn::MulAdd(hn::ConvertTo(tag, hn::Iota(IntTag(), 0)), hn::Set(tag, 4.0f),
                      hn::Set(tag, static_cast<float>(first)));
}
// The point that a pixel of this column shows; start: of its row, z: its depth, m.
HWY_INLINE Vec3 surface_point(const Rays& rays, const glm::vec3& start, Float column, Float z) {
    return spread(rays.eye) + Vec3(Float(start.x) + column * Float(rays.right.x),
                                   Float(start.y) + column * Float(rays.right.y),
                                   Float(start.z) + column * Float(rays.right.z)) *
                                  z;
}
// The lower left of the four grid points around pixels 4k + phase of a row is point k + this one.
HWY_INLINE std::ptrdiff_t left_of(int phase) {
    return phase < 2 ? -1 : 0;
}
HWY_INLINE std::ptrdiff_t row_below(int y) {
    return y >= 2 ? (y - 2) / 4 : -1;
}
