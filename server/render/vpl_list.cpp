#include "server/render/vpl_list.h"

#include <algorithm>
#include <map>
#include <numbers>

#include "shaders/lib/as_cpp.h"

namespace gonio {
namespace {

// Texels below this share of the brightest carry no measurable light; without the cut their weights would underflow.
constexpr float kDarkShare = 1e-7f;

unsigned deinterleave(unsigned bits) {
    unsigned result = 0;
    for (unsigned i = 0; i < 16; ++i) result |= ((bits >> (2 * i)) & 1u) << i;
    return result;
}

// Texel indices along a Morton curve on each face: neighbours on the curve are neighbours on the surface.
const std::vector<std::uint32_t>& morton_order(int size) {
    static thread_local std::map<int, std::vector<std::uint32_t>> cache;
    std::vector<std::uint32_t>& order = cache[size];
    if (order.empty()) {
        unsigned side = 1;
        while (side < static_cast<unsigned>(size)) side *= 2;
        order.reserve(static_cast<std::size_t>(6) * size * size);
        for (unsigned face = 0; face < 6; ++face) {
            for (unsigned code = 0; code < side * side; ++code) {
                const unsigned x = deinterleave(code), y = deinterleave(code >> 1);
                if (x < static_cast<unsigned>(size) && y < static_cast<unsigned>(size)) {
                    order.push_back((face * static_cast<unsigned>(size) + y) * static_cast<unsigned>(size) + x);
                }
            }
        }
    }
    return order;
}

}  // namespace

glm::dvec3 RsmTexels::position(std::size_t texel) const {
    const auto n = static_cast<std::size_t>(size);
    const std::size_t face = texel / (n * n), y = texel / n % n, x = texel % n;
    const glm::dvec2 st((2.0 * static_cast<double>(x) + 1.0) / size - 1.0,
                        (2.0 * static_cast<double>(y) + 1.0) / size - 1.0);
    return glm::normalize(glsl64::cube_direction(static_cast<int>(face), st)) *
           static_cast<double>(radial_depth[texel]);
}

glm::dvec3 RsmTexels::normal_of(std::size_t texel) const {
    return glsl64::octahedral_decode(
        glm::dvec2(std::max(normal[2 * texel] / 32767.0, -1.0), std::max(normal[2 * texel + 1] / 32767.0, -1.0)));
}

VplList sample_vpls(const RsmTexels& rsm, unsigned count) {
    VplList list;
    float brightest = 0.0f;
    for (const glm::vec4& flux : rsm.flux) brightest = std::max(brightest, glsl::luminance(glm::vec3(flux)));
    if (!(brightest > 0.0f) || count == 0) return list;

    const std::vector<std::uint32_t>& order = morton_order(rsm.size);
    const auto weight = [&](std::uint32_t texel) {
        const float w = glsl::luminance(glm::vec3(rsm.flux[texel])) / brightest;
        return w < kDarkShare ? 0.0 : static_cast<double>(w);
    };
    double total = 0.0;
    for (std::uint32_t texel : order) total += weight(texel);

    list.per_subset = (count + kVplSubsets - 1) / kVplSubsets;
    list.stride = (list.per_subset + 15) / 16 * 16;  // whole 256-byte steps: the strictest uniform buffer alignment
    list.vpls.assign(static_cast<std::size_t>(kVplSubsets) * list.stride, layouts::Vpl{});
    const unsigned n = list.per_subset * kVplSubsets;
    double before = 0.0;
    unsigned k = 0;
    for (std::uint32_t texel : order) {
        const double w = weight(texel);
        if (w <= 0.0) continue;
        const double after = before + w;
        // Stratum k is hit at its middle: (k + ½) / N of the total.
        for (; k < n && (k + 0.5) / n * total < after; ++k) {
            const double share = total / (w * n);  // 1 / (N q)
            layouts::Vpl& vpl = list.vpls[k % kVplSubsets * list.stride + k / kVplSubsets];
            vpl.position_area =
                glm::vec4(glm::vec3(rsm.position(texel)), rsm.flux[texel].a * static_cast<float>(share));
            vpl.normal = glm::vec4(glm::vec3(rsm.normal_of(texel)), 0.0f);
            vpl.intensity = glm::vec4(glm::vec3(glm::dvec3(rsm.flux[texel]) * (share / std::numbers::pi)), 0.0f);
        }
        before = after;
    }
    return list;
}

glm::dvec3 dense_irradiance(const RsmTexels& rsm, const glm::dvec3& point, const glm::dvec3& normal) {
    glm::dvec3 sum(0.0);
    for (std::size_t texel = 0; texel < rsm.flux.size(); ++texel) {
        const glm::vec4& flux = rsm.flux[texel];
        if (flux.r <= 0.0f && flux.g <= 0.0f && flux.b <= 0.0f) continue;
        const double geometry = glsl64::vpl_geometry(point - rsm.position(texel), rsm.normal_of(texel), normal,
                                                     static_cast<double>(flux.a));
        sum += glm::dvec3(flux) * (geometry / std::numbers::pi);
    }
    return sum;
}

glm::dvec3 list_irradiance(const VplList& list, const glm::dvec3& point, const glm::dvec3& normal) {
    glm::dvec3 sum(0.0);
    for (const layouts::Vpl& vpl : list.vpls) {
        sum += glm::dvec3(vpl.intensity) * glsl64::vpl_geometry(point - glm::dvec3(vpl.position_area),
                                                                glm::dvec3(vpl.normal), normal,
                                                                static_cast<double>(vpl.position_area.w));
    }
    return sum;
}

}  // namespace gonio
