#include <algorithm>
#include <cmath>

#include "server/shade/screen.h"

namespace gonio::shade {
namespace {

// Shadow rays start this share of a pixel's width off its surface: depth and normals are those of pixels, not exact.
constexpr float kOffPerPixel = 0.02f;
// Off the plane of its neighbours by this share of its depth, a pixel may lie on another surface.
constexpr float kOffPlane = 1e-2f;

// Two by two pixels: no light reaches them; the ray of the first is seen or hidden; each has to be asked.
enum class Block : std::uint8_t { dark, seen, hidden, mixed };
constexpr int kBlock = 2, kStripRows = 4 * kBlock;  // a packet of rays is a square of 4 × 4 blocks

// Rays to one luminaire, sent off sixteen at a time.
class ShadowRays {
public:
    ShadowRays(const trace::Geometry& geometry, const glm::vec3& light) : geometry_(geometry), light_(light) {}

    // Result: bits of the hidden rays so far; sent off when the packet is full.
    bool add(const glm::vec3& from) {
        const int i = count_++;
        query_.set(i, from, light_ - from, 1.0f - 1e-5f);  // a luminaire mounted on a surface is not hidden by it
        return count_ == trace::kPacket;
    }
    unsigned send() {
        const unsigned all = (1u << count_) - 1u;
        const unsigned hidden = count_ > 0 ? geometry_.occluded(query_, all, true) : 0u;
        count_ = 0;
        return hidden;
    }
    int count() const { return count_; }

private:
    const trace::Geometry& geometry_;
    glm::vec3 light_;
    trace::RayPacket query_;
    int count_ = 0;
};

// Blocks of a picture with a border of dark ones.
struct Blocks {
    int width, height;
    std::vector<Block> states;
    // Packets of 4 × 4 blocks: the state of all of them, or mixed; with a border of dark ones.
    int packets_x, packets_y;
    std::vector<Block> packets;

    Blocks(int picture_width, int picture_height)
        : width(picture_width / kBlock),
          height((picture_height + kBlock - 1) / kBlock),
          packets_x(width / 4 + 2),
          packets_y((height + 3) / 4 + 2) {
        states.assign(static_cast<std::size_t>(width + 2) * static_cast<std::size_t>(height + 2), Block::dark);
        packets.assign(static_cast<std::size_t>(packets_x) * static_cast<std::size_t>(packets_y), Block::dark);
    }
    Block& packet(int x, int y) {
        return packets[static_cast<std::size_t>(y + 1) * static_cast<std::size_t>(packets_x) +
                       static_cast<std::size_t>(x + 1)];
    }
    // Result: whether a packet and its neighbours are all dark or seen: nothing has to be done.
    bool calm(int x, int y) {
        const Block own = packet(x, y);
        if (own != Block::dark && own != Block::seen) return false;
        for (int j = -1; j <= 1; ++j) {
            for (int i = -1; i <= 1; ++i) {
                const Block other = packet(x + i, y + j);
                if (other != own && own != Block::dark && other != Block::dark) return false;
            }
        }
        return true;
    }
    Block& at(int x, int y) {
        return states[static_cast<std::size_t>(y + 1) * static_cast<std::size_t>(width + 2) +
                      static_cast<std::size_t>(x + 1)];
    }
    // Result: whether what the block's ray found holds for all of its pixels: so it is all around.
    bool sure(int x, int y) {
        const Block own = at(x, y);
        for (int j = -1; j <= 1; ++j) {
            for (int i = -1; i <= 1; ++i) {
                const Block other = at(x + i, y + j);
                if (other != own && other != Block::dark) return false;
            }
        }
        return own != Block::mixed;
    }
};

// The picture's arrays at the pixels of a block: 0 1 below 2 3; in the last row of an odd picture the same twice.
struct Corners4 {
    std::size_t at[4];
    Corners4(const Surfaces& s, int x, int y) {
        const std::size_t low = static_cast<std::size_t>(y) * s.row_length + static_cast<std::size_t>(x),
                          high = y + 1 < s.height ? low + s.row_length : low;
        at[0] = low, at[1] = low + 1, at[2] = high, at[3] = high + 1;
    }
};

Block looks_like(const Surfaces& s, const Corners4& corner, const std::vector<float>& lux) {
    int lit = 0;
    for (const std::size_t i : corner.at) lit += lux[i] > 0.0f ? 1 : 0;
    if (lit == 0) return Block::dark;
    // near / depth is linear on a plane.
    const auto d = [&](int i) { return s.depth[corner.at[i]]; };
    return lit == 4 && std::abs(d(0) + d(3) - d(1) - d(2)) <= kOffPlane * d(0) ? Block::seen : Block::mixed;
}

}  // namespace

void direct_light(const Surfaces& surfaces, const trace::Geometry& geometry, const DirectLight& light, bool every_pixel,
                  std::vector<float>& out, Pool& pool) {
    const std::size_t length = surfaces.row_length;
    out.resize(length * static_cast<std::size_t>(surfaces.height));
    const float off_m = 4.0f * geometry.step_off(light.position),
                off_per_depth = kOffPerPixel * surfaces.depth_per_pixel;
    const int strips = (surfaces.height + kStripRows - 1) / kStripRows;
    Blocks blocks(static_cast<int>(length), surfaces.height);
    pool.run(strips, [&](int strip) {
        static thread_local std::vector<float> from[3];
        for (std::vector<float>& array : from) array.resize(length * kStripRows);
        const int top = strip * kStripRows, rows = std::min(kStripRows, surfaces.height - top);
        for (int y = 0; y < rows; ++y) {
            const std::size_t row = static_cast<std::size_t>(top + y) * length,
                              own = static_cast<std::size_t>(y) * length;
            direct_row(light, top + y, static_cast<int>(length), surfaces.rays, off_m, off_per_depth,
                       surfaces.depth.data() + row, surfaces.normal.data() + row, out.data() + row,
                       from[0].data() + own, from[1].data() + own, from[2].data() + own);
        }
        ShadowRays rays(geometry, light.position);
        for (int x = 0; x < static_cast<int>(length); x += 4 * kBlock) {
            Block* asked[trace::kPacket];
            for (int i = 0; i < trace::kPacket; ++i) {
                const int px = x + i % 4 * kBlock, py = top + i / 4 * kBlock;
                if (py >= surfaces.height) break;
                Block& block = blocks.at(px / kBlock, py / kBlock);
                block = looks_like(surfaces, Corners4(surfaces, px, py), out);
                if (every_pixel && block == Block::seen) block = Block::mixed;
                if (block != Block::seen) continue;
                const std::size_t own = static_cast<std::size_t>(py - top) * length + static_cast<std::size_t>(px);
                asked[rays.count()] = &block;
                rays.add({from[0][own], from[1][own], from[2][own]});
            }
            const int count = rays.count();
            const unsigned hidden = rays.send();
            for (int i = 0; i < count; ++i) {
                if ((hidden >> i & 1u) != 0) *asked[i] = Block::hidden;
            }
            Block& packet = blocks.packet(x / (4 * kBlock), strip);
            packet = blocks.at(x / kBlock, top / kBlock);
            for (int i = 1; i < trace::kPacket; ++i) {
                const int by = top / kBlock + i / 4;
                if (by < blocks.height && blocks.at(x / kBlock + i % 4, by) != packet) packet = Block::mixed;
            }
        }
    });
    pool.run(strips, [&](int strip) {
        ShadowRays rays(geometry, light.position);
        std::size_t asked[trace::kPacket];
        const auto send = [&] {
            const int count = rays.count();
            const unsigned hidden = rays.send();
            for (int i = 0; i < count; ++i) {
                if ((hidden >> i & 1u) != 0) out[asked[i]] = 0.0f;
            }
        };
        const int top = strip * kStripRows, bottom = std::min(top + kStripRows, surfaces.height);
        const auto finish = [&](int x, int y) {
            const Block block = blocks.at(x / kBlock, y / kBlock);
            if (block == Block::dark) return;
            const Corners4 corner(surfaces, x, y);
            if (blocks.sure(x / kBlock, y / kBlock)) {
                if (block == Block::hidden) {
                    for (const std::size_t i : corner.at) out[i] = 0.0f;
                }
                return;
            }
            for (int k = 0; k < (y + 1 < surfaces.height ? 4 : 2); ++k) {
                if (!(out[corner.at[k]] > 0.0f)) continue;
                const Spot spot = spot_at(surfaces, x + k % 2, y + k / 2);
                asked[rays.count()] = corner.at[k];
                if (rays.add(spot.position + spot.normal * (off_m + off_per_depth * spot.depth))) send();
            }
        };
        for (int x = 0; x < surfaces.width; x += 4 * kBlock) {
            if (blocks.calm(x / (4 * kBlock), strip)) continue;
            for (int y = top; y < bottom; y += kBlock) {
                for (int i = x; i < std::min(x + 4 * kBlock, surfaces.width); i += kBlock) finish(i, y);
            }
        }
        send();
    });
}

}  // namespace gonio::shade
