#include <algorithm>
#include <array>
#include <cmath>

#include "server/shade/screen.h"

namespace gonio::shade {
namespace {

// Shadow rays start this share of a pixel's width off its surface: depth and normals are those of pixels, not exact.
constexpr float kOffPerPixel = 0.02f;

// What is known of a square of pixels: rays from it reached the luminaire, or did not; each of its pixels is asked.
constexpr std::uint8_t kSeen = 1, kHidden = 2, kBoth = kSeen | kHidden, kAsked = 4;

// Squares of pixels, with a border of those that nothing is known of.
struct Squares {
    std::ptrdiff_t row;
    std::vector<std::uint8_t> states;

    Squares(int side_px, int picture_width, int picture_height)
        : row(picture_width / side_px + 2),
          states(static_cast<std::size_t>(row) *
                 static_cast<std::size_t>((picture_height + side_px - 1) / side_px + 2)) {}
    std::uint8_t& at(int x, int y) { return states[static_cast<std::size_t>((y + 1) * row + x + 1)]; }
    // Result: what is known of a square and its eight neighbours.
    unsigned around(int x, int y) {
        const std::uint8_t* s = &at(x, y);
        return s[-row - 1] | s[-row] | s[-row + 1] | s[-1] | s[0] | s[1] | s[row - 1] | s[row] | s[row + 1];
    }
};

// Rays to one luminaire, sixteen at a time; what they find goes to the squares of those who ask, and pixels that they
// ask for alone go dark.
class ShadowRays {
public:
    ShadowRays(const trace::Geometry& geometry, const glm::vec3& light) : geometry_(geometry), light_(light) {}

    void ask(const glm::vec3& from, std::uint8_t* square, float* pixel) {
        query_.set(count_, from, light_ - from, 1.0f - 1e-5f);  // a luminaire mounted on a surface is not hidden by it
        asked_[static_cast<std::size_t>(count_)] = {square, pixel};
        if (++count_ == trace::kPacket) send();
    }
    void send() {
        const unsigned hidden = count_ > 0 ? geometry_.occluded(query_, (1u << count_) - 1u, true) : 0u;
        for (int i = 0; i < count_; ++i) {
            const Asked& asked = asked_[static_cast<std::size_t>(i)];
            const bool dark = (hidden >> i & 1u) != 0;
            if (asked.square != nullptr) *asked.square |= dark ? kHidden : kSeen;
            if (dark && asked.pixel != nullptr) *asked.pixel = 0.0f;
        }
        count_ = 0;
    }

private:
    struct Asked {
        std::uint8_t* square;
        float* pixel;
    };
    const trace::Geometry& geometry_;
    glm::vec3 light_;
    trace::RayPacket query_;
    std::array<Asked, trace::kPacket> asked_;
    int count_ = 0;
};

// A picture in one luminaire's light.
struct Lit {
    const Surfaces& surfaces;
    std::vector<float>& lux;
    float off_m, off_per_depth;

    // In the last rows of a picture whose height is no multiple of a square's the last one counts for those above.
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(std::min(y, surfaces.height - 1)) * surfaces.row_length +
               static_cast<std::size_t>(x);
    }
    Square two_by_two(int x, int y) const {
        int lit = 0;
        for (int i = 0; i < 4; ++i) lit += lux[index(x + i % 2, y + i / 2)] > 0.0f ? 1 : 0;
        if (lit == 0) return Square::dark;
        const auto d = [&](int i, int j) { return surfaces.depth[index(x + i, y + j)]; };
        const float off = std::abs(d(0, 0) + d(1, 1) - d(0, 1) - d(1, 0));
        return lit == 4 && off <= kOffPlane * d(0, 0) ? Square::plane : Square::mixed;
    }
    glm::vec3 from(int x, int y) const {
        const Spot spot = spot_at(surfaces, x, y);
        return spot.position + spot.normal * (off_m + off_per_depth * spot.depth);
    }
    void ask_two_by_two(int x, int y, std::uint8_t* square, ShadowRays& rays) const {
        for (int j = y; j < std::min(y + 2, surfaces.height); ++j) {
            for (int i = x; i < x + 2; ++i) {
                float& pixel = lux[index(i, j)];
                if (pixel > 0.0f) rays.ask(from(i, j), square, &pixel);
            }
        }
    }
    void darken(int x, int y, int side) const {
        for (int j = 0; j < side; ++j) std::fill_n(&lux[index(x, y + j)], side, 0.0f);
    }
};

}  // namespace

void direct_light(const Surfaces& surfaces, const trace::Geometry& geometry, const DirectLight& light, bool every_pixel,
                  std::vector<float>& out, Pool& pool) {
    constexpr int kStripRows = 8;
    const int length = static_cast<int>(surfaces.row_length), height = surfaces.height;
    out.resize(surfaces.row_length * static_cast<std::size_t>(height));
    const Lit lit{surfaces, out, 4.0f * geometry.step_off(light.position), kOffPerPixel * surfaces.depth_per_pixel};
    Squares fours(4, length, height), parted(4, length, height), twos(2, length, height);
    // Visits each square of 4 × 4 pixels with rays of its strip's own.
    const auto each_four = [&](const auto& visit) {
        pool.run((height + kStripRows - 1) / kStripRows, [&](int strip) {
            ShadowRays rays(geometry, light.position);
            const int top = strip * kStripRows, bottom = std::min(top + kStripRows, height);
            for (int x = 0; x < length; x += 4)
                for (int y = top; y < bottom; y += 4) visit(x, y, rays);
            rays.send();
        });
    };

    // A ray from each square on a plane.
    constexpr int kRows = 16;
    pool.run((height + kRows - 1) / kRows, [&](int strip) {
        static thread_local std::vector<float> from[3];
        static thread_local std::vector<Square> squares;
        const std::size_t row_length = surfaces.row_length / 4;
        for (std::vector<float>& array : from) array.resize(kRows / 4 * row_length);
        squares.assign(kRows / 4 * row_length, Square::dark);
        const int top = strip * kRows, bottom = std::min(top + kRows, height);
        for (int y = top; y < bottom; ++y) {
            const std::size_t row = lit.index(0, y);
            direct_row(light, y, length, surfaces.rays, &surfaces.depth[row], &surfaces.normal[row], &out[row]);
        }
        for (int y = top; y < bottom; y += 4) {
            const float *depth[4], *lux[4];
            for (int j = 0; j < 4; ++j)
                depth[j] = &surfaces.depth[lit.index(0, y + j)], lux[j] = &out[lit.index(0, y + j)];
            const std::size_t own = static_cast<std::size_t>((y - top) / 4) * row_length;
            squares_row(surfaces.rays, std::min(y + 1, height - 1), length, lit.off_m, lit.off_per_depth, depth,
                        &surfaces.normal[lit.index(0, y + 1)], lux, &squares[own], &from[0][own], &from[1][own],
                        &from[2][own]);
        }
        ShadowRays rays(geometry, light.position);
        for (int x = 0; x < length; x += 4) {
            for (int y = top; y < bottom; y += 4) {
                const std::size_t i =
                    static_cast<std::size_t>((y - top) / 4) * row_length + static_cast<std::size_t>(x / 4);
                std::uint8_t& four = fours.at(x / 4, y / 4);
                if (squares[i] == Square::plane && !every_pixel)
                    rays.ask({from[0][i], from[1][i], from[2][i]}, &four, nullptr);
                else if (squares[i] != Square::dark)
                    four = kAsked;
            }
        }
        rays.send();
    });
    // Where those around it found otherwise, or it is on no plane: a ray from each square of 2 × 2 pixels on a plane;
    // of others each pixel.
    each_four([&](int x, int y, ShadowRays& rays) {
        const std::uint8_t own = fours.at(x / 4, y / 4);
        if (own == 0) return;
        const bool mixed = own == kAsked;
        const bool whole = !mixed && (fours.around(x / 4, y / 4) & kBoth) != kBoth;
        if (whole && own == kHidden) lit.darken(x, y, 4);
        parted.at(x / 4, y / 4) = whole ? 0 : 1;
        for (int i = 0; i < 4; ++i) {
            const int px = x + i % 2 * 2, py = y + i / 2 * 2;
            if (py >= height) break;
            std::uint8_t& two = twos.at(px / 2, py / 2);
            const Square square = mixed ? lit.two_by_two(px, py) : Square::plane;
            if (square == Square::mixed || (every_pixel && square != Square::dark)) {
                lit.ask_two_by_two(px, py, &two, rays);
                two |= kAsked;
            } else if (whole || (!mixed && i == 0)) {
                two = own;
            } else if (square == Square::plane) {
                rays.ask(lit.from(px, py), &two, nullptr);
            }
        }
    });
    if (every_pixel) return;
    // Where those around it found otherwise: each pixel.
    each_four([&](int x, int y, ShadowRays& rays) {
        if (parted.around(x / 4, y / 4) == 0) return;
        for (int i = 0; i < 4; ++i) {
            const int px = x + i % 2 * 2, py = y + i / 2 * 2;
            if (py >= height) break;
            const std::uint8_t two = twos.at(px / 2, py / 2);
            if (two == 0 || (two & kAsked) != 0) continue;
            if ((twos.around(px / 2, py / 2) & kBoth) == kBoth)
                lit.ask_two_by_two(px, py, nullptr, rays);
            else if (two == kHidden)
                lit.darken(px, py, 2);
        }
    });
}

}  // namespace gonio::shade
