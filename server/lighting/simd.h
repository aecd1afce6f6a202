// The pure GLSL of shaders/lib compiled for SIMD lanes: one maths source for shaders, tests and these kernels. Included
// inside HWY_NAMESPACE once per instruction set, by files that Highway compiles for several (hwy/foreach_target.h);
// therefore without an include guard and without a namespace of its own.

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<float>;
using Raw = hn::Vec<Tag>;
using IntTag = hn::RebindToSigned<Tag>;
using Mask = hn::Mask<Tag>;

// One float per SIMD lane.
struct Float {
    Raw raw;
    HWY_INLINE Float() : raw(hn::Zero(Tag())) {}
    HWY_INLINE Float(Raw r) : raw(r) {}
    HWY_INLINE Float(float x) : raw(hn::Set(Tag(), x)) {}

    HWY_INLINE friend Float operator+(Float a, Float b) { return hn::Add(a.raw, b.raw); }
    HWY_INLINE friend Float operator-(Float a, Float b) { return hn::Sub(a.raw, b.raw); }
    HWY_INLINE friend Float operator*(Float a, Float b) { return hn::Mul(a.raw, b.raw); }
    HWY_INLINE friend Float operator-(Float a) { return hn::Neg(a.raw); }
    // By reciprocal and one Newton step: relative error below 1e-6 for divisors of 1e-36 to 1e36.
    HWY_INLINE friend Float operator/(Float a, Float b) {
        const Raw r = hn::ApproximateReciprocal(b.raw);
        return hn::Mul(a.raw, hn::Mul(r, hn::NegMulAdd(b.raw, r, hn::Set(Tag(), 2.0f))));
    }
    HWY_INLINE friend Mask operator<(Float a, Float b) { return hn::Lt(a.raw, b.raw); }
    HWY_INLINE friend Float max(Float a, Float b) { return hn::Max(a.raw, b.raw); }
    HWY_INLINE friend Float min(Float a, Float b) { return hn::Min(a.raw, b.raw); }
    HWY_INLINE friend Float abs(Float a) { return hn::Abs(a.raw); }
    HWY_INLINE friend Float sqrt(Float a) { return hn::Sqrt(a.raw); }
    HWY_INLINE friend Float mix(Float no, Float yes, Mask which) { return hn::IfThenElse(which, yes.raw, no.raw); }
};
HWY_INLINE Float inversesqrt(Float a) {
    const Raw r = hn::ApproximateReciprocalSqrt(a.raw);
    const Raw half = hn::Mul(hn::Mul(a.raw, hn::Set(Tag(), 0.5f)), r);
    return hn::Mul(r, hn::NegMulAdd(half, r, hn::Set(Tag(), 1.5f)));
}
HWY_INLINE Float load(const float* p) {
    return hn::LoadU(Tag(), p);
}
HWY_INLINE void store(Float a, float* p) {
    hn::StoreU(a.raw, Tag(), p);
}

// The angle of (x, y), -pi..pi, within 1e-6 rad; (0, 0) gives 0.
HWY_INLINE Float atan(Float y, Float x) {
    const Float ax = abs(x), ay = abs(y);
    const Float t = min(ax, ay) / max(max(ax, ay), Float(1e-30f)), t2 = t * t;
    // Odd polynomial for 0..1, fitted for the least greatest error, 2.5e-7.
    constexpr float kTerms[] = {0.00681169145f, -0.0336038978f, 0.0796232799f, -0.132333193f,
                                0.198078091f,   -0.333173673f,  0.999996111f};
    Float a(0.0f);
    for (const float term : kTerms) a = hn::MulAdd(a.raw, t2.raw, hn::Set(Tag(), term));
    a = a * t;
    a = mix(a, Float(1.57079633f) - a, ax < ay);
    a = mix(a, Float(3.14159265f) - a, x < Float(0.0f));
    return hn::CopySign(a.raw, y.raw);
}

struct Vec2 {
    Float x, y;
    HWY_INLINE Vec2(Float a, Float b) : x(a), y(b) {}
};
struct Vec3 {
    Float x, y, z;
    HWY_INLINE Vec3() {}  // NOLINT(modernize-use-equals-default): it would be no part of the target
    HWY_INLINE Vec3(Float a, Float b, Float c) : x(a), y(b), z(c) {}

    HWY_INLINE friend Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    HWY_INLINE friend Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    HWY_INLINE friend Vec3 operator*(const Vec3& a, Float s) { return {a.x * s, a.y * s, a.z * s}; }
    HWY_INLINE friend Float dot(const Vec3& a, const Vec3& b) {
        return hn::MulAdd(a.x.raw, b.x.raw, hn::MulAdd(a.y.raw, b.y.raw, hn::Mul(a.z.raw, b.z.raw)));
    }
};

HWY_INLINE Vec3 spread(const glm::vec3& v) {
    return {Float(v.x), Float(v.y), Float(v.z)};
}
HWY_INLINE Vec3 turned(const glm::mat3& m, const Vec3& v) {
    return {Float(m[0][0]) * v.x + Float(m[1][0]) * v.y + Float(m[2][0]) * v.z,
            Float(m[0][1]) * v.x + Float(m[1][1]) * v.y + Float(m[2][1]) * v.z,
            Float(m[0][2]) * v.x + Float(m[1][2]) * v.y + Float(m[2][2]) * v.z};
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#define float Float
#define vec2 Vec2
#define vec3 Vec3
namespace {
#include "shaders/lib/edge_weight.glsl"
#include "shaders/lib/web.glsl"
}  // namespace
#undef float
#undef vec2
#undef vec3
#pragma GCC diagnostic pop
