#include "server/bake/split.h"

#include <algorithm>
#include <array>
#include <deque>

#include "server/bake/validity.h"

namespace gonio::bake {
namespace {

constexpr double kAboveTexels = 0.1;  // how high over the surface texels look for each other: over what its bend hides
constexpr std::array<glm::ivec2, 4> kFourAround{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
constexpr int kNone = -1, kHidden = -2;  // labels: nothing is there; inside something
constexpr int kApart = 2;   // texels within so many of each other share what filtering reads: each side has a gutter
constexpr int kDetour = 1;  // steps that a way round may be longer: else the two are apart

// The covered texels of a sheet and which of their neighbours they see.
struct Links {
    glm::ivec2 size;
    std::vector<int> index;                    // of covered, -1: none
    std::vector<std::array<char, 4>> blocked;  // of covered, by kFourAround
    std::vector<char> hidden;                  // of covered: inside something
    std::vector<std::vector<int>> apart;       // of covered: those that must be in other parts
    bool any = false;

    int at(const glm::ivec2& p) const {
        if (p.x < 0 || p.y < 0 || p.x >= size.x || p.y >= size.y) return -1;
        return index[static_cast<std::size_t>(p.y) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(p.x)];
    }
};

struct Surface {
    const std::vector<Covered>& covered;
    const std::vector<Texel>& texels;
    const trace::Geometry& geometry;
    float above_m;

    bool sees(int a, int b) const {
        return bake::sees(geometry, texels[static_cast<std::size_t>(a)], texels[static_cast<std::size_t>(b)], above_m);
    }
    glm::ivec2 at(int i) const { return covered[static_cast<std::size_t>(i)].at; }
};

Links look_around(const Sheet& sheet, const Surface& surface) {
    Links links{sheet.size, {}, {}, {}, {}};
    const std::size_t count = surface.covered.size();
    links.index.assign(static_cast<std::size_t>(sheet.size.x) * static_cast<std::size_t>(sheet.size.y), -1);
    links.blocked.assign(count, {});
    for (std::size_t i = 0; i < count; ++i) {
        const glm::ivec2 at = surface.covered[i].at;
        links.index[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(sheet.size.x) +
                    static_cast<std::size_t>(at.x)] = static_cast<int>(i);
    }
    for (std::size_t i = 0; i < count; ++i) {
        for (const std::size_t k : {0u, 1u}) {
            const int other = links.at(surface.covered[i].at + kFourAround[k]);
            if (other < 0 || surface.sees(static_cast<int>(i), other)) continue;
            links.any = true;
            links.blocked[i][k] = 1;
            links.blocked[static_cast<std::size_t>(other)][k + 2] = 1;
        }
    }
    return links;
}

// Result: whether one texel leads to another by neighbours that see each other, hardly further than straight on.
bool way_round(const Surface& surface, const Links& links, int from, int to) {
    const glm::ivec2 off = glm::abs(surface.at(to) - surface.at(from));
    std::vector<int> front{from}, seen{from}, next;
    for (int steps = off.x + off.y + kDetour; steps > 0 && !front.empty(); --steps) {
        next.clear();
        for (const int i : front) {
            for (std::size_t k = 0; k < 4; ++k) {
                const int other = links.at(surface.at(i) + kFourAround[k]);
                if (other < 0 || links.blocked[static_cast<std::size_t>(i)][k] != 0 ||
                    links.hidden[static_cast<std::size_t>(other)] != 0)
                    continue;
                if (other == to) return true;
                if (std::find(seen.begin(), seen.end(), other) != seen.end()) continue;
                seen.push_back(other);
                next.push_back(other);
            }
        }
        front.swap(next);
    }
    return false;
}

// Which texels a wall keeps apart.
void find_apart(const Surface& surface, Links& links) {
    const std::size_t count = surface.covered.size();
    links.apart.assign(count, {});
    std::vector<char> near(count, 0);
    const auto each_near = [&](std::size_t i, auto&& job) {
        for (int y = -kApart; y <= kApart; ++y) {
            for (int x = -kApart; x <= kApart; ++x) {
                const int other = links.at(surface.covered[i].at + glm::ivec2(x, y));
                if (other >= 0) job(other);
            }
        }
    };
    for (std::size_t i = 0; i < count; ++i) {
        const auto& blocked = links.blocked[i];
        if (std::any_of(blocked.begin(), blocked.end(), [](char b) { return b != 0; }))
            each_near(i, [&](int other) { near[static_cast<std::size_t>(other)] = 1; });
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (near[i] == 0 || links.hidden[i] != 0) continue;
        const auto self = static_cast<int>(i);
        each_near(i, [&](int other) {
            if (other <= self || links.hidden[static_cast<std::size_t>(other)] != 0) return;
            if (surface.sees(self, other) || way_round(surface, links, self, other)) return;
            links.apart[i].push_back(other);
            links.apart[static_cast<std::size_t>(other)].push_back(self);
        });
    }
}

// Result: of each covered texel its part, so that no two of a part are apart; kHidden.
std::vector<int> label(const Surface& surface, const Links& links, int& parts) {
    std::vector<int> labels(surface.covered.size(), kNone);
    for (std::size_t i = 0; i < labels.size(); ++i) {
        if (links.hidden[i] != 0) labels[i] = kHidden;
    }
    parts = 0;
    for (std::size_t seed = 0; seed < labels.size(); ++seed) {
        if (labels[seed] != kNone) continue;
        labels[seed] = parts;
        std::deque<int> front{static_cast<int>(seed)};
        while (!front.empty()) {
            const int from = front.front();
            front.pop_front();
            for (std::size_t k = 0; k < 4; ++k) {
                const int next = links.at(surface.at(from) + kFourAround[k]);
                if (next < 0 || labels[static_cast<std::size_t>(next)] != kNone ||
                    links.blocked[static_cast<std::size_t>(from)][k] != 0)
                    continue;
                const auto& apart = links.apart[static_cast<std::size_t>(next)];
                if (std::any_of(apart.begin(), apart.end(),
                                [&](int other) { return labels[static_cast<std::size_t>(other)] == parts; }))
                    continue;
                labels[static_cast<std::size_t>(next)] = parts;
                front.push_back(next);
            }
        }
        ++parts;
    }
    return labels;
}

// Quarters of texels and the part that each is of; hidden ones go to the nearest part.
struct Quarters {
    glm::ivec2 size;
    std::vector<int> label;

    int& at(const glm::ivec2& p) {
        return label[static_cast<std::size_t>(p.y) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(p.x)];
    }
};

Quarters quarter(const Sheet& sheet, const std::vector<Covered>& covered, const std::vector<int>& labels, int& parts) {
    Quarters quarters{2 * sheet.size, {}};
    quarters.label.assign(4 * static_cast<std::size_t>(sheet.size.x) * static_cast<std::size_t>(sheet.size.y), kNone);
    std::deque<glm::ivec2> front;
    for (std::size_t i = 0; i < covered.size(); ++i) {
        for (const glm::ivec2 q : {glm::ivec2(0, 0), {1, 0}, {0, 1}, {1, 1}}) {
            quarters.at(2 * covered[i].at + q) = labels[i];
            if (labels[i] >= 0) front.push_back(2 * covered[i].at + q);
        }
    }
    const auto spread = [&] {
        while (!front.empty()) {
            const glm::ivec2 from = front.front();
            front.pop_front();
            for (std::size_t k = 0; k < 4; ++k) {
                const glm::ivec2 next = from + kFourAround[k];
                if (next.x < 0 || next.y < 0 || next.x >= quarters.size.x || next.y >= quarters.size.y) continue;
                if (quarters.at(next) != kHidden) continue;
                quarters.at(next) = quarters.at(from);
                front.push_back(next);
            }
        }
    };
    spread();
    for (std::size_t i = 0; i < covered.size(); ++i) {  // hidden on all sides
        const glm::ivec2 at = 2 * covered[i].at;
        if (quarters.at(at) != kHidden) continue;
        quarters.at(at) = parts++;
        front.push_back(at);
        spread();
    }
    return quarters;
}

// Rectangles of quarters of one part.
struct Block {
    glm::ivec2 low, high;
    int part;
};

std::vector<Block> blocks_of(Quarters& quarters) {
    std::vector<Block> blocks;
    std::vector<Block> above;  // that end at this row
    for (int y = 0; y < quarters.size.y; ++y) {
        std::vector<Block> row;
        for (int x = 0; x < quarters.size.x;) {
            const int part = quarters.at({x, y}), from = x;
            while (x < quarters.size.x && quarters.at({x, y}) == part) ++x;
            if (part < 0) continue;
            Block block{{from, y}, {x, y + 1}, part};
            for (Block& upper : above) {
                if (upper.part == part && upper.low.x == from && upper.high.x == x) {
                    block.low.y = upper.low.y;
                    upper.part = kNone;  // goes on
                }
            }
            row.push_back(block);
        }
        for (const Block& ended : above) {
            if (ended.part >= 0) blocks.push_back(ended);
        }
        above = std::move(row);
    }
    blocks.insert(blocks.end(), above.begin(), above.end());
    return blocks;
}

}  // namespace

Parts split_sheet(Sheet sheet, const std::vector<Covered>& covered, const std::vector<Texel>& texels,
                  const trace::Geometry& geometry, const std::vector<char>& solids, double texel_m) {
    const Surface surface{covered, texels, geometry, static_cast<float>(kAboveTexels * texel_m)};
    Links links = look_around(sheet, surface);
    Parts result;
    if (!links.any) {
        result.sheets.push_back(std::move(sheet));
        return result;
    }
    for (const Texel& texel : texels) links.hidden.push_back(texel.valid && is_inside(geometry, solids, texel) ? 1 : 0);
    find_apart(surface, links);
    int parts = 0;
    const std::vector<int> labels = label(surface, links, parts);
    if (parts <= 1) {
        result.sheets.push_back(std::move(sheet));
        return result;
    }
    Quarters quarters = quarter(sheet, covered, labels, parts);
    const std::vector<Block> blocks = blocks_of(quarters);
    std::vector<glm::ivec2> low(static_cast<std::size_t>(parts), glm::ivec2(1 << 30)),
        high(static_cast<std::size_t>(parts), glm::ivec2(0));
    for (const Block& block : blocks) {
        const auto part = static_cast<std::size_t>(block.part);
        low[part] = glm::min(low[part], block.low / 2);
        high[part] = glm::max(high[part], (block.high + 1) / 2);
    }
    std::vector<std::vector<const Block*>> of_part(static_cast<std::size_t>(parts));
    for (const Block& block : blocks) of_part[static_cast<std::size_t>(block.part)].push_back(&block);
    for (std::size_t part = 0; part < static_cast<std::size_t>(parts); ++part) {
        Sheet& cut = result.sheets.emplace_back();
        cut.chart = sheet.chart;
        cut.size = glm::max(high[part] - low[part], glm::ivec2(1));
        std::vector<int> number(sheet.sides.size(), -1);
        const glm::dvec2 shift(low[part]);
        for (const Piece& piece : sheet.pieces) {
            glm::dvec2 from(1e300), to(-1e300);
            for (const glm::dvec2& p : piece.outline) from = glm::min(from, p), to = glm::max(to, p);
            for (const Block* block : of_part[part]) {
                const glm::dvec2 a = 0.5 * glm::dvec2(block->low), b = 0.5 * glm::dvec2(block->high);
                if (a.x >= to.x || a.y >= to.y || b.x <= from.x || b.y <= from.y) continue;
                Polygon outline = clipped(piece.outline, a, b);
                if (outline.empty()) continue;
                for (glm::dvec2& p : outline) p -= shift;
                const auto side = static_cast<std::size_t>(piece.side);
                if (number[side] < 0) {
                    number[side] = static_cast<int>(cut.sides.size());
                    cut.sides.push_back(sheet.sides[side]);
                    auto flat = sheet.flat[side];
                    for (glm::dvec2& p : flat) p -= shift;
                    cut.flat.push_back(flat);
                    cut.m2_per_texel.push_back(sheet.m2_per_texel[side]);
                }
                cut.pieces.push_back({number[side], std::move(outline)});
            }
        }
    }
    for (std::size_t i = 0; i < covered.size(); ++i) {
        for (const std::size_t k : {0u, 1u}) {
            const int other = links.at(covered[i].at + kFourAround[k]);
            if (other < 0 || links.blocked[i][k] != 0 || labels[i] < 0 || labels[static_cast<std::size_t>(other)] < 0 ||
                labels[i] == labels[static_cast<std::size_t>(other)])
                continue;
            const glm::dvec2 to(covered[i].at + 1), from = k == 0 ? to - glm::dvec2(0, 1) : to - glm::dvec2(1, 0);
            CutSeam& seam = result.seams.emplace_back();
            seam.part[0] = labels[i], seam.part[1] = labels[static_cast<std::size_t>(other)];
            for (int s = 0; s < 2; ++s) {
                const glm::dvec2 shift(low[static_cast<std::size_t>(seam.part[s])]);
                seam.from[s] = from - shift, seam.to[s] = to - shift;
            }
        }
    }
    return result;
}

}  // namespace gonio::bake
