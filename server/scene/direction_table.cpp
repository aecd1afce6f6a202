#include "server/scene/direction_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace gonio {
namespace {

constexpr int kPolar = 360, kAzimuth = 360;
constexpr double kPolarStep = std::numbers::pi / kPolar, kAzimuthStep = 2.0 * std::numbers::pi / kAzimuth;

constexpr std::size_t cell_at(int v, int h) {
    return static_cast<std::size_t>(v) * kAzimuth + static_cast<std::size_t>(h);
}

// Result: the cell of running sums that x falls into.
template <typename Sum>
std::size_t cell_of(std::span<const Sum> sums, double x) {
    const auto below = std::upper_bound(sums.begin(), sums.end(), x) - sums.begin() - 1;
    return std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, below)), sums.size() - 2);
}

// Direction with polar angle from -Z and azimuth from +X towards +Y: LM-63's Type C angles.
glm::dvec3 direction_at(double cos_polar, double azimuth) {
    const double sine = std::sqrt(std::max(0.0, 1.0 - cos_polar * cos_polar));
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), -cos_polar};
}

// Result: the cell of a direction in the luminaire frame: polar × kAzimuth + azimuth.
std::size_t cell_at(const glm::dvec3& d) {
    const double polar = std::atan2(std::sqrt(d.x * d.x + d.y * d.y), -d.z);
    double azimuth = std::atan2(d.y, d.x);
    if (azimuth < 0.0) azimuth += 2.0 * std::numbers::pi;
    const int v = std::clamp(static_cast<int>(polar / kPolarStep), 0, kPolar - 1);
    const int h = std::clamp(static_cast<int>(azimuth / kAzimuthStep), 0, kAzimuth - 1);
    return cell_at(v, h);
}

// Cells of the table, each with the largest intensity seen in it, cd. The table's grid points: the cells' corners, the
// middles of their edges and their centres.
struct Cells {
    static constexpr int kPointsV = 2 * kPolar + 1, kPointsH = 2 * kAzimuth;
    std::vector<float> greatest = std::vector<float>(static_cast<std::size_t>(kPolar) * kAzimuth, 0.0f);

    void raise(std::size_t cell, float candela) { greatest[cell] = std::max(greatest[cell], candela); }
    // Of every cell that it is a grid point of.
    void raise_point(int v, int h, float candela) {
        for (int i = std::max((v - 1) / 2, 0); i <= std::min(v / 2, kPolar - 1); ++i) {
            raise(cell_at(i, h / 2), candela);
            if (h % 2 == 0) raise(cell_at(i, (h / 2 + kAzimuth - 1) % kAzimuth), candela);
        }
    }
};

// Where equal steps from 0 fall among a web's angles.
struct Steps {
    struct At {
        std::size_t low;
        float fraction;
        bool inside;
    };
    std::vector<At> at;
    Steps(const std::vector<double>& angles, int count, double step) {
        std::size_t low = 0;
        for (int i = 0; i < count; ++i) {
            const double x = i * step;
            while (low + 2 < angles.size() && angles[low + 1] <= x) ++low;
            const double fraction = (x - angles[low]) / (angles[low + 1] - angles[low]);
            at.push_back({low, static_cast<float>(std::clamp(fraction, 0.0, 1.0)),
                          x >= angles.front() - 1e-9 && x <= angles.back() + 1e-9});
        }
    }
};

// Type C has the table's own angles: on a line of the web's grid intensity is greatest at its own angles or where the
// line crosses one of the table's.
void see_type_c(const ies::PhotometricWeb& web, Cells& cells) {
    const Steps v_steps(web.v_rad, Cells::kPointsV, 0.5 * kPolarStep),
        h_steps(web.h_rad, Cells::kPointsH, 0.5 * kAzimuthStep);
    const std::size_t n_v = web.v_rad.size();
    std::vector<float> plane(n_v);
    const auto row_of = [](double v) { return std::clamp(static_cast<int>(v / kPolarStep), 0, kPolar - 1); };
    // What lies within a cell and on no edge is at its middle grid point.
    const auto see_plane = [&](int point_h) {
        for (std::size_t v = 0; v < n_v; ++v) cells.raise_point(2 * row_of(web.v_rad[v]) + 1, point_h, plane[v]);
        for (int v = 0; v < Cells::kPointsV; ++v) {
            const Steps::At& at = v_steps.at[static_cast<std::size_t>(v)];
            if (at.inside)
                cells.raise_point(v, point_h, plane[at.low] + at.fraction * (plane[at.low + 1] - plane[at.low]));
        }
    };
    for (int h = 0; h < Cells::kPointsH; ++h) {
        const Steps::At& at = h_steps.at[static_cast<std::size_t>(h)];
        if (!at.inside) continue;
        for (std::size_t v = 0; v < n_v; ++v)
            plane[v] = web.at(at.low, v) + at.fraction * (web.at(at.low + 1, v) - web.at(at.low, v));
        see_plane(h);
    }
    for (std::size_t h = 0; h < web.h_rad.size(); ++h) {
        std::copy_n(web.candela.begin() + static_cast<std::ptrdiff_t>(h * n_v), n_v, plane.begin());
        see_plane(2 * std::clamp(static_cast<int>(web.h_rad[h] / kAzimuthStep), 0, kAzimuth - 1) + 1);
    }
}

// Types A and B cross the table's cells: their lines are followed in steps of a quarter of a degree.
void see_others(const ies::PhotometricWeb& web, Cells& cells) {
    for (int v = 0; v < Cells::kPointsV; ++v) {
        for (int h = 0; h < Cells::kPointsH; ++h) {
            const glm::dvec3 d = direction_at(std::cos(0.5 * v * kPolarStep), 0.5 * h * kAzimuthStep);
            cells.raise_point(v, h, static_cast<float>(ies::intensity(web, {d.x, d.y, d.z}).in(cd)));
        }
    }
    const auto raise = [&](double v, double h, float candela) {
        if (!(candela > 0.0f)) return;
        const ies::Direction d = ies::direction_of(web.goniometer, Angle::radians(v), Angle::radians(h));
        cells.raise(cell_at({d[0], d[1], d[2]}), candela);
    };
    const auto walk = [&](double v0, double h0, float c0, double v1, double h1, float c1) {
        if (!(c0 > 0.0f) && !(c1 > 0.0f)) return;
        const int steps = 1 + static_cast<int>(std::max(std::abs(v1 - v0), std::abs(h1 - h0)) / (0.5 * kPolarStep));
        for (int i = 0; i <= steps; ++i) {
            const double t = static_cast<double>(i) / steps;
            raise(std::lerp(v0, v1, t), std::lerp(h0, h1, t),
                  static_cast<float>(std::lerp(static_cast<double>(c0), static_cast<double>(c1), t)));
        }
    };
    for (std::size_t h = 0; h < web.h_rad.size(); ++h) {
        for (std::size_t v = 0; v < web.v_rad.size(); ++v) {
            if (v + 1 < web.v_rad.size())
                walk(web.v_rad[v], web.h_rad[h], web.at(h, v), web.v_rad[v + 1], web.h_rad[h], web.at(h, v + 1));
            if (h + 1 < web.h_rad.size())
                walk(web.v_rad[v], web.h_rad[h], web.at(h, v), web.v_rad[v], web.h_rad[h + 1], web.at(h + 1, v));
        }
    }
}

}  // namespace

DirectionTable::DirectionTable(const ies::PhotometricWeb& web) {
    Cells cells;
    if (web.goniometer == ies::Goniometer::type_c)
        see_type_c(web, cells);
    else
        see_others(web, cells);
    std::vector<float>& cell = cells.greatest;
    rows_.push_back(0.0);
    columns_.reserve(static_cast<std::size_t>(kPolar) * (kAzimuth + 1));
    for (int v = 0; v < kPolar; ++v) {
        const double solid_angle = (std::cos(v * kPolarStep) - std::cos((v + 1) * kPolarStep)) * kAzimuthStep;
        double row = 0.0;
        const std::size_t first = columns_.size();
        columns_.push_back(0.0f);
        for (int h = 0; h < kAzimuth; ++h) {
            row += static_cast<double>(cell[cell_at(v, h)]);
            columns_.push_back(static_cast<float>(row));
        }
        for (std::size_t h = first; h < columns_.size(); ++h) {
            columns_[h] = row > 0.0 ? static_cast<float>(static_cast<double>(columns_[h]) / row)
                                    : static_cast<float>(h - first) / kAzimuth;
        }
        total_ += row * solid_angle;
        rows_.push_back(total_);
    }
    // draw() takes a row by its share of the total and a cell by its share of the row; with the row's share the same
    // as the sum of its cells times their solid angle, the density is the cell's intensity over the total.
    densities_ = std::move(cell);
    for (float& density : densities_)
        density = total_ > 0.0 ? static_cast<float>(static_cast<double>(density) / total_) : 0.0f;
}

glm::dvec3 DirectionTable::draw(glm::vec2 random, double& density) const {
    const double x = static_cast<double>(random.x) * total_;
    const std::size_t v = cell_of(std::span(rows_), x);
    const double row = rows_[v + 1] - rows_[v];
    const double across = row > 0.0 ? std::clamp((x - rows_[v]) / row, 0.0, 1.0) : 0.5;
    const std::span columns = std::span(columns_).subspan(v * (kAzimuth + 1), kAzimuth + 1);
    const double y = static_cast<double>(random.y);
    const std::size_t h = cell_of(columns, y);
    const double cell = static_cast<double>(columns[h + 1] - columns[h]);
    const double along = cell > 0.0 ? std::clamp((y - static_cast<double>(columns[h])) / cell, 0.0, 1.0) : 0.5;
    const double top = std::cos(static_cast<double>(v) * kPolarStep),
                 bottom = std::cos(static_cast<double>(v + 1) * kPolarStep);
    density = row * cell / total_ / ((top - bottom) * kAzimuthStep);
    return direction_at(top + (bottom - top) * across, (static_cast<double>(h) + along) * kAzimuthStep);
}

double DirectionTable::density(const glm::dvec3& d) const {
    return static_cast<double>(densities_[cell_at(d)]);
}

std::vector<glm::vec3> DirectionTable::lit_directions() const {
    // Rounded to sixteenths, off by half their diagonal; middles of cells are off by half of theirs.
    constexpr int kPer = 16, kSide = 2 * kPer + 1;
    static_assert(0.87 / kPer + 0.5 * (kPolarStep + kAzimuthStep) < double{kLitDirectionsOff});
    std::vector<bool> lit(std::size_t{kSide} * kSide * kSide);
    for (int v = 0; v < kPolar; ++v) {
        for (int h = 0; h < kAzimuth; ++h) {
            if (!(densities_[cell_at(v, h)] > 0.0f)) continue;
            const glm::dvec3 d = direction_at(std::cos((v + 0.5) * kPolarStep), (h + 0.5) * kAzimuthStep);
            const auto cell = [&](int k) { return static_cast<std::size_t>(std::lround(kPer * d[k]) + kPer); };
            lit[(cell(2) * kSide + cell(1)) * kSide + cell(0)] = true;
        }
    }
    std::vector<glm::vec3> directions;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
        if (lit[static_cast<std::size_t>(i)])
            directions.push_back(glm::vec3(i % kSide - kPer, i / kSide % kSide - kPer, i / (kSide * kSide) - kPer) /
                                 static_cast<float>(kPer));
    }
    return directions;
}

float DirectionTable::beam_cosine() const {
    int row = kPolar;
    while (row > 0 && !(rows_[static_cast<std::size_t>(row)] > rows_[static_cast<std::size_t>(row) - 1])) --row;
    return static_cast<float>(std::cos(std::min(row + 1, kPolar) * kPolarStep));
}

}  // namespace gonio
