#include "server/bake/direct.h"

#include <algorithm>
#include <cmath>

#include "server/trace/sampler.h"

namespace gonio::bake {
namespace {

constexpr int kDirectTile = 64;                 // texels of one job
constexpr int kParts = 4, kPenumbraParts = 32;  // of an opening at least; where some of its rays are stopped
constexpr float kToLuminaire = 1.0f - 1e-5f;    // a luminaire mounted on a surface is not hidden by it

// A part of an opening, in the unit square that Luminaire::point takes.
struct Part {
    double x, y, width, height;
};

class Receiver {
public:
    Receiver(const trace::Geometry& geometry, const trace::Luminaire& luminaire, const DirectSettings& settings)
        : geometry_(geometry), luminaire_(luminaire), settings_(settings), shadow_(geometry, Add{&tally_}) {}

    // Result: mean and half difference of the two halves, lx.
    std::pair<float, float> at(const Texel& texel, std::uint64_t& rays) {
        position_ = glm::dvec3(texel.position);
        from_ = texel.position + texel.geometric * geometry_.step_off(texel.position);
        texel_ = &texel;
        seed_ =
            trace::mix_bits(trace::mix_bits(settings_.seed, luminaire_.light), static_cast<std::uint32_t>(texel.pixel));
        const bool point = !settings_.openings || luminaire_.opening.shape == ies::OpeningShape::point;
        begin();
        if (point) {
            add(luminaire_.position, 1.0, 0);
            shadow_.send();
            rays += asked_;
            return {static_cast<float>(tally_.lx[0]), 0.0f};
        }
        sample(kParts, settings_.opening_points);
        rays += asked_;
        if (tally_.seen > 0 && tally_.hidden > 0) {  // a penumbra
            begin();
            sample(kPenumbraParts, kPenumbraParts * settings_.opening_points / kParts);
            rays += asked_;
        }
        const double* const lx = tally_.lx;
        return {static_cast<float>(0.5 * (lx[0] + lx[1])), static_cast<float>(0.5 * std::abs(lx[0] - lx[1]))};
    }

private:
    struct Lit {
        float lx = 0.0f;
        int half = 0;
    };
    struct Tally {
        double lx[2] = {0.0, 0.0};  // of each half
        int seen = 0, hidden = 0;   // rays
    };
    struct Add {
        Tally* tally;
        void operator()(const Lit& lit, const glm::vec3& passed) const {
            const float part = trace::luminous(passed);
            tally->lx[lit.half] += static_cast<double>(lit.lx * part);
            ++(part > 0.0f ? tally->seen : tally->hidden);
        }
    };

    void begin() {
        tally_ = {};
        asked_ = 0;
        parts_ = 0;
    }

    // A rectangle in so many parts at least; another shape in so many points.
    void sample(int least_parts, int points) {
        if (luminaire_.opening.shape == ies::OpeningShape::rectangle) {
            largest_share_ = 1.0 / least_parts;
            split({0.0, 0.0, 1.0, 1.0}, seed_);
        } else {
            const int half = std::max(1, points / 2);
            for (int h = 0; h < 2; ++h) {
                for (int i = 0; i < half; ++i) {
                    trace::Sample random(trace::mix_bits(seed_, static_cast<std::uint32_t>(h)),
                                         static_cast<std::uint32_t>(i));
                    const glm::vec2 first = random.next();
                    add(luminaire_.point(first, random.next()), 1.0 / half, h);
                }
            }
        }
        shadow_.send();
    }

    // Halves a rectangle along its longer side until each part is small beside its distance; then a point of it for
    // each half.
    void split(const Part& part, std::uint32_t seed) {
        const double x = part.width * luminaire_.opening.length.in(m), y = part.height * luminaire_.opening.width.in(m);
        const glm::dvec3 centre =
            luminaire_.point(glm::vec2(part.x + 0.5 * part.width, part.y + 0.5 * part.height), glm::vec2(0.5f));
        const double distance = glm::length(centre - position_), longest = std::max(x, y);
        // A part may be nearer than its centre by half of it.
        const double nearest = std::max(distance - 0.5 * longest, 0.0);
        const bool near = longest > settings_.part * nearest && longest > 1e-4 * luminaire_.opening_radius_m;
        if ((near || part.width * part.height > 1.001 * largest_share_) && parts_ + 2 <= kMostParts) {
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
            trace::Sample numbers(seed, static_cast<std::uint32_t>(h));
            const glm::dvec2 random(numbers.next());
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
        ++asked_;
        shadow_.add(from_, glm::vec3(source) - from_, kToLuminaire, {static_cast<float>(lx), half});
    }

    const trace::Geometry& geometry_;
    const trace::Luminaire& luminaire_;
    const DirectSettings& settings_;
    const Texel* texel_ = nullptr;
    glm::dvec3 position_{0.0};
    glm::vec3 from_{0.0f};
    std::uint32_t seed_ = 0;
    double largest_share_ = 1.0;
    Tally tally_;
    int parts_ = 0;
    std::uint64_t asked_ = 0;
    trace::ShadowRays<Lit, Add> shadow_;
};

}  // namespace

bool direct_light(const Atlas& atlas, const trace::Geometry& geometry, const trace::Luminaire& luminaire,
                  const DirectSettings& settings, std::span<float> mean, std::span<float> error, Work& work) {
    return work.tiles(static_cast<int>(atlas.texels.size()), kDirectTile, [&](int first, int end) {
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
