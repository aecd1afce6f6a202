// Light of luminaires and of their openings' parts for SIMD lanes. Included after simd_web.h and as it is.

// Where light comes to a surface: cosine / distance², 0 from behind; to: from the luminaire. No nearer than least_d2.
HWY_INLINE Float falloff(const Vec3& to, const Vec3& n, float least_d2 = 1e-12f) {
    const Float per_d = inversesqrt(max(dot(to, to), Float(least_d2)));
    return max(-dot(n, to), Float(0.0f)) * per_d * per_d * per_d;
}

// Result: parts small enough for what is so far from an opening (in: from its middle, the luminaire's frame).
HWY_INLINE const SoftParts::Level& parts_for(const DirectLight& light, const Vec3& in) {
    const SoftParts& parts = *light.parts;
    const auto beyond = [](Float x, float half) { return max(abs(x) - Float(half), Float(0.0f)); };
    const Vec3 off(beyond(in.x, parts.half_m.x), beyond(in.y, parts.half_m.y), beyond(in.z, parts.half_m.z));
    const float nearest_m = std::sqrt(hn::GetLane(hn::MinOfLanes(Tag(), dot(off, off).raw)));
    std::size_t level = 0;
    // The one point is a rule of one degree, the others are of three.
    while (level + 1 < parts.levels.size() &&
           nearest_m < parts.levels[level].size_m * light.fineness * (level == 0 ? 2.0f : 1.0f))
        ++level;
    return parts.levels[level];
}

// Sum over an opening's parts of their share of I / I_peak × falloff, 1/m²; to: from its middle.
HWY_INLINE Float from_parts(const DirectLight& light, const Vec3& to, const Vec3& n) {
    const SoftParts::Level& level = parts_for(light, turned(light.light_from_world, to));
    Float sum;
    for (const glm::vec3& part : level.at) {
        const Vec3 to_part = to - spread(part);
        const Float share = falloff(to_part, n, light.parts->least_d2);
        if (hn::AllFalse(Tag(), Float(0.0f) < share)) continue;
        sum = sum + share * web_ratio(light.web, turned(light.light_from_world, to_part));
    }
    return sum * Float(1.0f / static_cast<float>(level.at.size()));
}

// What from_parts() is near a multiple of, 1/m²: as falloff(), but even where the horizon of a surface goes through the
// opening, so that the multiple may be interpolated.
HWY_INLINE Float even_falloff(const SoftParts& parts, const Vec3& to, const Vec3& n) {
    const Float height = dot(n, to), per_d = inversesqrt(max(dot(to, to), Float(parts.least_d2)));
    return sqrt(height * height + Float(parts.radius_m * parts.radius_m)) * per_d * per_d * per_d;
}
