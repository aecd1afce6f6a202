#include "server/transport/fixed_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/transport/residual.h"
#include "server/transport/surfels.h"

namespace gonio::transport {
namespace {

constexpr std::size_t kMostColumns = 4;  // what the normal equations below have room for

using Dots = std::array<std::array<glm::dvec3, kMostColumns + 1>, kMostColumns>;
using Weights = std::array<glm::vec4, kMostColumns>;  // of each column, by channel

// The larger one, or NaN where either is: a value that is not a number must not pass for a small one.
float greater(float a, float b) {
    return a >= b || std::isnan(a) ? a : b;
}
template <typename Channels>
Channels greater(const Channels& a, const Channels& b) {
    Channels result;
    for (int k = 0; k < Channels::length(); ++k) result[k] = greater(a[k], b[k]);
    return result;
}
float greatest_of(const glm::vec3& channels) {
    return greater(greater(channels.r, channels.g), channels.b);
}

// What residuals are compared with, besides the light itself: 1 % of the channel's mean, a millionth of the brightest
// channel's, so that what rounding leaves of a colour that has faded counts as nothing.
glm::vec3 floor_of(const glm::vec3& mean) {
    return glm::max(0.01f * mean, std::max(1e-6f * std::max({mean.r, mean.g, mean.b}), 1e-30f));
}

// Solves the normal equations of min |R - sum w_j dR_j| for one channel by Cholesky's method, with 1e-7 of the diagonal
// added against columns that are nearly parallel. Columns that add nothing have the weight 0.
void solve_channel(const Dots& dots, std::size_t columns, int channel, Weights& weights) {
    double l[kMostColumns][kMostColumns] = {}, y[kMostColumns] = {};
    for (std::size_t i = 0; i < columns; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = dots[i][j][channel] * (i == j ? 1.0 + 1e-7 : 1.0);
            for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
            if (i == j)
                l[i][i] = sum > 0.0 ? std::sqrt(sum) : 0.0;
            else
                l[i][j] = l[j][j] > 0.0 ? sum / l[j][j] : 0.0;
        }
        double sum = dots[i][kMostColumns][channel];
        for (std::size_t k = 0; k < i; ++k) sum -= l[i][k] * y[k];
        y[i] = l[i][i] > 0.0 ? sum / l[i][i] : 0.0;
    }
    for (std::size_t i = columns; i-- > 0;) {
        double sum = y[i];
        for (std::size_t k = i + 1; k < columns; ++k) sum -= l[k][i] * static_cast<double>(weights[k][channel]);
        weights[i][channel] = static_cast<float>(l[i][i] > 0.0 ? sum / l[i][i] : 0.0);
    }
    const bool usable = std::all_of(weights.begin(), weights.begin() + static_cast<std::ptrdiff_t>(columns),
                                    [&](const glm::vec4& weight) { return std::isfinite(weight[channel]); });
    for (std::size_t i = 0; i < columns && !usable; ++i) weights[i][channel] = 0.0f;
}

}  // namespace

FixedPoint::FixedPoint(std::vector<glm::vec4>& e, const glm::vec3& bound, unsigned columns, Pool& pool)
    : e_(e), bound_(bound), most_columns_(std::min<unsigned>(columns, kMostColumns)), pool_(pool) {
    const auto sum_of = [&](std::size_t first, std::size_t count) {
        glm::dvec3 sum(0.0);
        for (std::size_t i = first; i < first + count; ++i) sum += glm::dvec3(e_[i]);
        return sum;
    };
    mean_ = glm::vec3(pool_.reduce_chunks(e_.size(), kSurfelsAJob, glm::dvec3(0.0), sum_of, std::plus<>()) /
                      std::max(static_cast<double>(e_.size()), 1.0));
}

StepReport FixedPoint::step(const Bounce& bounce) {
    bounce(e_, f_);
    r_.resize(e_.size());
    const glm::vec3 floor = floor_of(mean_);
    struct Found {
        Residual residual;
        glm::dvec3 change{0.0}, sum{0.0};
    };
    const auto look = [&](std::size_t first, std::size_t count) {
        const Residual residual = compare(std::span(e_).subspan(first, count), std::span(f_).subspan(first, count),
                                          floor, std::span(r_).subspan(first, count));
        return Found{residual, glm::dvec3(residual.change), glm::dvec3(residual.sum)};
    };
    const Found found = pool_.reduce_chunks(e_.size(), kSurfelsAJob, Found(), look, [](Found a, const Found& b) {
        a.residual.most = greater(a.residual.most, b.residual.most);
        a.residual.greatest = glm::max(a.residual.greatest, b.residual.greatest);
        a.residual.relative = greater(a.residual.relative, b.residual.relative);
        a.change += b.change, a.sum += b.sum;
        return a;
    });
    StepReport report;
    report.residual = found.residual.most;
    report.greatest = found.residual.greatest;
    report.by_channel = found.residual.relative;
    report.relative = greatest_of(report.by_channel);
    const double sum = found.sum.r + found.sum.g + found.sum.b;
    report.change = sum > 0.0 ? static_cast<float>((found.change.r + found.change.g + found.change.b) / sum) : 0.0f;
    mean_ = glm::vec3(found.sum / std::max(static_cast<double>(e_.size()), 1.0));
    // A ratio to a residual that is down to the rounding of the tables says nothing.
    constexpr float kRounding = 1.0f / 2048.0f;
    if (expected_ > kRounding) {
        ratios_[steps_ % ratios_.size()] = report.relative / expected_;
        ++steps_;
    }
    expected_ = report.relative;
    if (most_columns_ > 0) report.accelerated = combine(report);
    if (!report.accelerated) e_.swap(f_);
    return report;
}

float FixedPoint::contraction() const {
    return steps_ == 0 ? 1.0f : std::min(*std::max_element(ratios_.begin(), ratios_.end()), 1.0f);
}

// Result: whether E has become a combination of iterates; where not, f_ is yet to become E.
bool FixedPoint::combine(StepReport& report) {
    const std::size_t n = e_.size();
    if (last_f_.size() != n) {
        last_f_ = f_, last_r_ = r_;
        return false;
    }
    // The newest column takes the place of the oldest.
    if (columns_.size() < most_columns_) columns_.emplace_back();
    std::rotate(columns_.begin(), columns_.end() - 1, columns_.end());
    columns_[0].f.resize(n), columns_[0].r.resize(n);
    const std::size_t columns = columns_.size();
    const glm::vec3 floor = floor_of(mean_);
    // Each surfel's residual counts by its share of its own light: dim rooms converge as bright ones do.
    const auto dots_of = [&](std::size_t first, std::size_t count) {
        Dots dots{};
        for (std::size_t i = first; i < first + count; ++i) {
            columns_[0].f[i] = f_[i] - last_f_[i], columns_[0].r[i] = r_[i] - last_r_[i];
            last_f_[i] = f_[i], last_r_[i] = r_[i];
            const glm::vec3 weight = 1.0f / (glm::vec3(f_[i]) + floor);
            glm::vec3 of[kMostColumns];
            const glm::vec3 right = weight * glm::vec3(r_[i]);
            for (std::size_t j = 0; j < columns; ++j) {
                of[j] = weight * glm::vec3(columns_[j].r[i]);
                for (std::size_t k = 0; k <= j; ++k) dots[j][k] += glm::dvec3(of[j]) * glm::dvec3(of[k]);
                dots[j][kMostColumns] += glm::dvec3(of[j]) * glm::dvec3(right);
            }
        }
        return dots;
    };
    const Dots dots = pool_.reduce_chunks(n, kSurfelsAJob, Dots{}, dots_of, [columns](Dots a, const Dots& b) {
        for (std::size_t j = 0; j < columns; ++j)
            for (std::size_t k = 0; k <= kMostColumns; ++k) a[j][k] += b[j][k];
        return a;
    });
    Weights weights{};
    for (int k = 0; k < 3; ++k) solve_channel(dots, columns, k, weights);
    // The combination replaces F by F - t × sum w dF, with the residual R - t × sum w dR. t <= 1 keeps it in bounds;
    // the residual is convex in t, so where it is smaller at 1 it is smaller at every t.
    struct Tried {
        glm::vec3 residual{0.0f}, relative{0.0f}, most{1.0f};
    };
    const auto off_at = [&](std::size_t i) {
        glm::vec4 off(0.0f);
        for (std::size_t j = 0; j < columns; ++j) off += weights[j] * columns_[j].f[i];
        return off;
    };
    const auto residual_at = [&](std::size_t i) {
        glm::vec4 residual = r_[i];
        for (std::size_t j = 0; j < columns; ++j) residual -= weights[j] * columns_[j].r[i];
        return residual;
    };
    const auto try_out = [&](std::size_t first, std::size_t count) {
        Tried tried;
        for (std::size_t i = first; i < first + count; ++i) {
            const glm::vec3 residual = glm::abs(glm::vec3(residual_at(i))), off(off_at(i));
            tried.residual = greater(tried.residual, residual);
            tried.relative = greater(tried.relative, residual / (glm::vec3(f_[i]) + floor));
            for (int k = 0; k < 3; ++k) {
                if (off[k] > f_[i][k]) tried.most[k] = std::min(tried.most[k], f_[i][k] / off[k]);
                if (f_[i][k] - off[k] > bound_[k])
                    tried.most[k] = std::min(tried.most[k], (bound_[k] - f_[i][k]) / -off[k]);
            }
        }
        return tried;
    };
    const Tried tried = pool_.reduce_chunks(n, kSurfelsAJob, Tried(), try_out, [](Tried a, const Tried& b) {
        a.residual = greater(a.residual, b.residual), a.relative = greater(a.relative, b.relative);
        a.most = glm::min(a.most, b.most);
        return a;
    });
    glm::vec4 share(0.0f);
    glm::vec3 relative = report.by_channel;
    for (int k = 0; k < 3; ++k) {
        if (!(tried.residual[k] < report.residual[k]) || !(tried.most[k] > 0.0f)) continue;
        share[k] = tried.most[k];
        relative[k] = glm::mix(relative[k], tried.relative[k], share[k]);
    }
    if (share == glm::vec4(0.0f)) return false;
    expected_ = std::max({relative.r, relative.g, relative.b});
    pool_.run_chunks(n, kSurfelsAJob, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i)
            e_[i] = glm::max(f_[i] - share * off_at(i), glm::vec4(0.0f));
    });
    return true;
}

}  // namespace gonio::transport
