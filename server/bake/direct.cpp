#include "server/bake/direct.h"

#include <algorithm>
#include <cmath>

#include "server/trace/sampler.h"

namespace gonio::bake {
namespace {

constexpr int kTile = 64;                     // texels of one job
constexpr float kToLuminaire = 1.0f - 1e-5f;  // a luminaire mounted on a surface is not hidden by it

// A part of an opening, in the unit square that Luminaire::point takes.
struct Part {
    double x, y, width, height;
};

class Receiver {
public:
    Receiver(const trace::Geometry& geometry, const trace::Luminaire& luminaire, const DirectSettings& settings)
        : geometry_(geometry), luminaire_(luminaire), settings_(settings), shadow_(geometry, Add{sum_}) {}

    // Result: mean and half difference of the two halves, lx.
    std::pair<float, float> at(const Texel& texel, std::uint64_t& rays) {
        position_ = glm::dvec3(texel.position);
        from_ = texel.position + texel.geometric * geometry_.step_off(texel.position);
        texel_ = &texel;
        sum_[0] = sum_[1] = 0.0;
        rays_ = 0;
        const ies::OpeningShape shape = luminaire_.opening.shape;
        if (!settings_.openings || shape == ies::OpeningShape::point) {
            add(luminaire_.position, 1.0, 0);
            shadow_.send();
            rays += rays_;
            return {static_cast<float>(sum_[0]), 0.0f};
        }
        const std::uint32_t seed =
            trace::mix_bits(trace::mix_bits(settings_.seed, luminaire_.light), static_cast<std::uint32_t>(texel.pixel));
        if (shape == ies::OpeningShape::rectangle) {
            parts_ = 0;
            const Part whole{0.0, 0.0, 1.0, 1.0};
            split(whole, seed);
        } else {
            const int half = std::max(1, settings_.opening_points / 2);
            for (int h = 0; h < 2; ++h) {
                for (int i = 0; i < half; ++i) {
                    trace::Sample sample(trace::mix_bits(seed, static_cast<std::uint32_t>(h)),
                                         static_cast<std::uint32_t>(i));
                    const glm::vec2 first = sample.next();
                    add(luminaire_.point(first, sample.next()), 1.0 / half, h);
                }
            }
        }
        shadow_.send();
        rays += rays_;
        return {static_cast<float>(0.5 * (sum_[0] + sum_[1])), static_cast<float>(0.5 * std::abs(sum_[0] - sum_[1]))};
    }

private:
    struct Lit {
        float lx = 0.0f;
        int half = 0;
    };
    struct Add {
        double* sum;
        void operator()(const Lit& lit, const glm::vec3& passed) const {
            sum[lit.half] += static_cast<double>(lit.lx * trace::luminous(passed));
        }
    };

    // Halves a rectangle along its longer side until each part is small beside its distance; then a point of it for
    // each half.
    void split(const Part& part, std::uint32_t seed) {
        const double x = part.width * luminaire_.opening.length.in(m), y = part.height * luminaire_.opening.width.in(m);
        const glm::dvec3 centre =
            luminaire_.point(glm::vec2(part.x + 0.5 * part.width, part.y + 0.5 * part.height), glm::vec2(0.5f));
        const double distance = glm::length(centre - position_), longest = std::max(x, y);
        // A part may be nearer than its centre by half of it.
        const double nearest = std::max(distance - 0.5 * longest, 0.0);
        if (longest > settings_.part * nearest && longest > 1e-4 * luminaire_.opening_radius_m &&
            parts_ + 2 <= kMostParts) {
            Part first = part, second = part;
            if (x >= y) {
                first.width = second.width = 0.5 * part.width;
                second.x += first.width;
            } else {
                first.height = second.height = 0.5 * part.height;
                second.y += first.height;
            }
            ++parts_;
            split(first, trace::mix_bits(seed, 1));
            split(second, trace::mix_bits(seed, 2));
            return;
        }
        for (int h = 0; h < 2; ++h) {
            trace::Sample sample(seed, static_cast<std::uint32_t>(h));
            const glm::dvec2 random(sample.next());
            add(luminaire_.point(glm::vec2(part.x + random.x * part.width, part.y + random.y * part.height),
                                 glm::vec2(0.5f)),
                part.width * part.height, h);
        }
    }

    void add(const glm::dvec3& source, double share, int half) {
        const glm::dvec3 d = position_ - source;
        const double distance2 = glm::dot(d, d);
        if (!(distance2 > 0.0)) return;
        const double distance = std::sqrt(distance2);
        const glm::dvec3 along = d / distance;
        const double cosine = -glm::dot(along, glm::dvec3(texel_->normal));
        if (cosine <= 0.0 || glm::dot(along, glm::dvec3(texel_->geometric)) >= 0.0) return;
        double lx = share * luminaire_.intensity_cd(along) * cosine / distance2;
        if (!(lx > 0.0)) return;
        if (settings_.haze) lx *= transmittance(settings_.haze, source, position_);
        ++rays_;
        shadow_.add(from_, glm::vec3(source) - from_, kToLuminaire, {static_cast<float>(lx), half});
    }

    const trace::Geometry& geometry_;
    const trace::Luminaire& luminaire_;
    const DirectSettings& settings_;
    const Texel* texel_ = nullptr;
    glm::dvec3 position_{0.0};
    glm::vec3 from_{0.0f};
    double sum_[2] = {0.0, 0.0};
    int parts_ = 0;
    std::uint64_t rays_ = 0;
    trace::ShadowRays<Lit, Add> shadow_;
};

}  // namespace

bool direct_light(const Atlas& atlas, const trace::Geometry& geometry, const trace::Luminaire& luminaire,
                  const DirectSettings& settings, std::span<float> mean, std::span<float> error, Work& work) {
    return work.tiles(static_cast<int>(atlas.texels.size()), kTile, [&](int first, int end) {
        Receiver receiver(geometry, luminaire, settings);
        std::uint64_t rays = 0;
        for (int i = first; i < end; ++i) {
            const auto at = static_cast<std::size_t>(i);
            mean[at] = error[at] = 0.0f;
            if (atlas.texels[at].valid) std::tie(mean[at], error[at]) = receiver.at(atlas.texels[at], rays);
        }
        work.rays += rays;
    });
}

}  // namespace gonio::bake
