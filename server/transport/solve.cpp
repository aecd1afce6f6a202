#include "server/transport/solve.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/transport/fixed_point.h"

namespace gonio::transport {
namespace {

constexpr unsigned kColumns = 2;  // earlier iterates that a step combines (docs/notebook/light.md)
// So many bounces shrink the residual by rho_max to this power at least. Where they do not even by the root of that, it
// is down to the rounding of the tables. Beside a bright place the largest residual is so early, while light still
// finds its way into dark rooms. Bounces change nothing more when the largest share of a surfel's own light stays as
// well.
constexpr unsigned kWatched = 12;

float most_of(const glm::vec3& v) {
    return std::max({v.r, v.g, v.b});
}

glm::vec3 greatest_albedo(const Surfels& surfels, Pool& pool) {
    const auto greatest = [&](std::size_t first, std::size_t count) {
        glm::vec3 albedo(0.0f);
        for (std::size_t i = first; i < first + count; ++i) albedo = glm::max(albedo, surfels.albedo[i]);
        return albedo;
    };
    return pool.reduce_chunks(surfels.count, kSurfelsAJob, glm::vec3(0.0f), greatest,
                              [](const glm::vec3& a, const glm::vec3& b) { return glm::max(a, b); });
}

glm::vec3 greatest_of(std::span<const glm::vec4> values, Pool& pool) {
    const auto greatest = [&](std::size_t first, std::size_t count) {
        glm::vec4 most(0.0f);
        for (const glm::vec4& value : values.subspan(first, count)) most = glm::max(most, value);
        return most;
    };
    return glm::vec3(pool.reduce_chunks(values.size(), kSurfelsAJob, glm::vec4(0.0f), greatest,
                                        [](const glm::vec4& a, const glm::vec4& b) { return glm::max(a, b); }));
}

// Light whose direct part is nowhere negative.
void solve_positive(const Surfels& surfels, const Links& links, std::span<const glm::vec4> exact,
                    std::span<const std::uint8_t> seen, const Accuracy& accuracy, Irradiance& light, Pool& pool) {
    Bounces bounces(surfels, links, light.direct, exact, light.haze, {accuracy.links, accuracy.rests, seen}, pool);
    light.narrow = bounces.narrow();
    if (light.indirect.size() != surfels.count || (accuracy.rests && !light.resumes)) {
        bounces.bounce({}, light.first);
        light.indirect = light.first;
    }
    const glm::vec3 albedo = greatest_albedo(surfels, pool);
    glm::vec3 bound(std::numeric_limits<float>::infinity());
    if (accuracy.rests) bound = greatest_of(light.first, pool) / glm::max(1.0f - albedo, 1e-3f);
    const unsigned before = light.resumes ? light.solved.bounces : 0;
    FixedPoint iteration(light.indirect, bound, accuracy.rests ? kColumns : 0, pool);
    const float slowest = most_of(albedo), halfway = std::pow(slowest, 0.5f * static_cast<float>(kWatched));
    constexpr float kNever = std::numeric_limits<float>::infinity();
    float watched = kNever, watched_share = kNever;  // the residual, and the relative one, kWatched bounces ago
    light.converged = light.resumes = false;
    for (unsigned bounced = 1;; ++bounced) {
        const StepReport step =
            iteration.step([&](std::span<const glm::vec4> e, std::vector<glm::vec4>& out) { bounces.bounce(e, out); });
        const float residual = most_of(step.residual), rate = std::min(iteration.contraction(), slowest);
        light.solved = {before + bounced,
                        residual / std::max(most_of(step.greatest), std::numeric_limits<float>::min()),
                        step.relative * rate / std::max(1.0f - rate, 1e-3f), rate};
        if (!accuracy.rests) {
            if (!(step.change > accuracy.least) || bounced >= accuracy.most) return;
            continue;
        }
        bool done = !(light.solved.error > accuracy.least) || light.solved.bounces >= kMostBounces;
        if (bounced % kWatched == 0) {
            done |= !(residual < watched * halfway) && !(step.relative < watched_share * halfway);
            watched = residual, watched_share = step.relative;
        }
        light.converged = done, light.resumes = !done;
        if (done || bounced >= accuracy.most) return;
    }
}

// What kinds of values light has.
struct Kinds {
    bool negative = false, finite = true;
};
Kinds kinds_of(std::span<const glm::vec4> values, Pool& pool) {
    const auto look = [&](std::size_t first, std::size_t count) {
        Kinds kinds;
        for (const glm::vec4& value : values.subspan(first, count)) {
            kinds.negative |= value.r < 0.0f || value.g < 0.0f || value.b < 0.0f;
            kinds.finite &= std::isfinite(value.r) && std::isfinite(value.g) && std::isfinite(value.b);
        }
        return kinds;
    };
    return pool.reduce_chunks(values.size(), kSurfelsAJob, Kinds(), look, [](Kinds a, Kinds b) {
        return Kinds{a.negative || b.negative, a.finite && b.finite};
    });
}

}  // namespace

void solve(const Surfels& surfels, const Links& links, std::span<const glm::vec4> exact,
           std::span<const std::uint8_t> seen, const Accuracy& accuracy, Irradiance& light, Pool& pool) {
    const Kinds direct = kinds_of(light.direct, pool), haze = kinds_of(light.haze, pool);
    if (!direct.finite || !haze.finite ||
        !kinds_of(exact, pool).finite) {  // nothing is shown of it, and the error says so
        light.indirect.assign(surfels.count, glm::vec4(0.0f));
        light.first = light.indirect;
        light.solved = {0, 0.0f, std::numeric_limits<float>::infinity(), 0.0f};
        light.converged = accuracy.rests, light.resumes = false;
        return;
    }
    if (!direct.negative && !haze.negative) {
        light.parts.clear();
        return solve_positive(surfels, links, exact, seen, accuracy, light, pool);
    }
    // The difference of two lights: the bounds hold for each of them alone.
    std::vector<Irradiance>& parts = light.parts;
    parts.resize(2);
    for (std::size_t k = 0; k < 2; ++k) {
        if (light.resumes && parts[k].converged) continue;
        parts[k].resumes &= light.resumes;
        const float sign = k == 0 ? 1.0f : -1.0f;
        const auto take = [&](const std::vector<glm::vec4>& from, std::vector<glm::vec4>& to) {
            to.clear();
            to.reserve(from.size());
            for (const glm::vec4& value : from) to.push_back(glm::max(sign * value, glm::vec4(0.0f)));
        };
        take(light.direct, parts[k].direct), take(light.haze, parts[k].haze);
        solve_positive(surfels, links, {}, seen, accuracy, parts[k], pool);
    }
    light.indirect.resize(surfels.count), light.first.resize(surfels.count);
    for (std::size_t i = 0; i < surfels.count; ++i) {
        light.indirect[i] = parts[0].indirect[i] - parts[1].indirect[i];
        light.first[i] = parts[0].first[i] - parts[1].first[i];
    }
    light.narrow = std::min(parts[0].narrow, parts[1].narrow);
    light.solved = {
        parts[0].solved.bounces + parts[1].solved.bounces, std::max(parts[0].solved.residual, parts[1].solved.residual),
        std::max(parts[0].solved.error, parts[1].solved.error), std::max(parts[0].solved.rate, parts[1].solved.rate)};
    light.converged = parts[0].converged && parts[1].converged, light.resumes = parts[0].resumes || parts[1].resumes;
}

void solve_to_the_end(const Surfels& surfels, const Links& links, Irradiance& light, Pool& pool,
                      const std::function<bool()>& stopped) {
    do {
        solve(surfels, links, {}, {}, kAtRest, light, pool);
    } while (light.resumes && !stopped());
}

}  // namespace gonio::transport
