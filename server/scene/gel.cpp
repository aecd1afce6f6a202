#include "server/scene/gel.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "ies/core/text.h"
#include "protocol/text/shortened_text.h"
#include "server/scene/white.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxGelName = 128;
constexpr glm::dvec2 kTungsten{0.4234, 0.3990};  // a Planckian radiator of 3200 K
constexpr glm::dvec2 kC{0.3101, 0.3162};         // CIE illuminant C, 6774 K
constexpr const char* kLee =
    "LEE Filters, leefilters.com: x, y and transmission Y with 3200 K and 6774 K (illuminant C)";

struct LeeRow {
    const char* name;
    double tungsten_percent, tungsten_x, tungsten_y, c_percent, c_x, c_y;
};
// As the maker's site gives them for each filter.
constexpr LeeRow kLeeRows[] = {
    {"L002 Rose Pink", 34.2, 0.491, 0.287, 32.7, 0.328, 0.202},
    {"L008 Dark Salmon", 43.0, 0.580, 0.374, 35.4, 0.498, 0.347},
    {"L010 Medium Yellow", 88.1, 0.492, 0.479, 86.5, 0.426, 0.509},
    {"L015 Deep Straw", 67.5, 0.549, 0.443, 60.8, 0.517, 0.460},
    {"L200 Double C.T. Blue", 14.9, 0.250, 0.256, 16.2, 0.179, 0.155},
    {"L201 Full C.T. Blue", 35.0, 0.330, 0.339, 34.0, 0.228, 0.233},
    {"L202 Half C.T. Blue", 53.2, 0.372, 0.374, 54.9, 0.261, 0.273},
    {"L203 Quarter C.T. Blue", 70.5, 0.398, 0.390, 69.3, 0.285, 0.294},
    {"L204 Full C.T. Orange", 62.8, 0.510, 0.420, 55.4, 0.437, 0.392},
    {"L205 Half C.T. Orange", 74.5, 0.474, 0.417, 70.8, 0.374, 0.364},
    {"L206 Quarter C.T. Orange", 82.6, 0.450, 0.410, 79.1, 0.346, 0.340},
    {"L218 Eighth C.T. Blue", 80.2, 0.411, 0.395, 81.3, 0.299, 0.307},
    {"L219 Fluorescent Green", 27.1, 0.319, 0.426, 31.0, 0.219, 0.334},
    {"L223 Eighth C.T. Orange", 85.0, 0.440, 0.406, 85.2, 0.328, 0.332},
    {"L707 Ultimate Violet", 1.5, 0.237, 0.078, 2.0, 0.170, 0.042},
    {"L711 Cold Blue", 12.8, 0.319, 0.318, 14.4, 0.223, 0.198},
};

// McCamy (1992): of a chromaticity near the Planckian locus.
double mired_of(const glm::dvec2& xy) {
    const double n = (xy.x - 0.3320) / (0.1858 - xy.y);
    return 1e6 / (((449 * n + 3525) * n + 6823.3) * n + 5520.33);
}

// What the gel does to linear Rec.709 of luminance 1, by one measurement.
glm::dvec3 filter_of(const GelMeasurement& measured) {
    return rgb_of_xy(measured.xy) / rgb_of_xy(measured.of_xy);
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) text.remove_suffix(1);
    return text;
}

std::optional<double> number_of(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

// The next field of a line; the last one takes the rest.
std::string_view take_field(std::string_view& line, bool last) {
    const std::size_t comma = last ? line.npos : line.find(',');
    const std::string_view field = trimmed(line.substr(0, comma));
    line.remove_prefix(comma == line.npos ? line.size() : comma + 1);
    return field;
}

// Of a real light: inside of what Rec.709 has, so that a filter can be a quotient.
bool is_light(const glm::dvec2& xy) {
    const glm::dvec3 rgb = rgb_of_xy(xy);
    return std::min({rgb.r, rgb.g, rgb.b}) > 0.01;
}

struct Line {
    std::string name, source;
    GelMeasurement measured;
};

Result<Line> read_line(std::string_view text, const std::string& place) {
    const auto bad = [&](std::string_view value, std::string why) {
        return Error{"bad_gels", place, shown_text(value), std::move(why)};
    };
    Line line;
    line.name = take_field(text, false);
    if (line.name.empty() || line.name.size() > kMaxGelName || shortened_text(line.name, kMaxGelName) != line.name)
        return bad(line.name, "a gel's name has 1 to 128 bytes of UTF-8 without control characters");
    double numbers[5];
    constexpr const char* kNames[] = {"transmission", "x", "y", "of_x", "of_y"};
    for (int i = 0; i < 5; ++i) {
        const std::string_view field = take_field(text, false);
        const auto number = number_of(field);
        if (!number || !(*number > 0 && *number <= 1))
            return bad(field, std::string(kNames[i]) + " must be a number above 0, at most 1");
        numbers[i] = *number;
    }
    line.measured = {{numbers[3], numbers[4]}, {numbers[1], numbers[2]}, numbers[0]};
    if (numbers[1] + numbers[2] > 1) return bad(line.name, "x and y must be at most 1 together");
    if (numbers[3] + numbers[4] > 1 || !is_light(line.measured.of_xy))
        return bad(line.name, "of_x, of_y must be a white light, such as 0.4234, 0.3990 (3200 K)");
    line.source = shortened_text(take_field(text, true), 256);
    return line;
}

Result<Gel> with_line(Gel gel, Line line, const std::string& place) {
    gel.name = line.name;
    if (!line.source.empty()) gel.source = line.source;
    gel.measured.push_back(line.measured);
    if (gel.measured.size() > 2) return Error{"bad_gels", place, shown_text(line.name), "a gel has at most two lines"};
    std::ranges::sort(gel.measured, std::greater(), [](const GelMeasurement& one) { return mired_of(one.of_xy); });
    if (gel.measured.size() == 2 && mired_of(gel.measured[0].of_xy) - mired_of(gel.measured[1].of_xy) < 10)
        return Error{"bad_gels", place, shown_text(line.name), "the lights of its two lines must be 10 mired apart"};
    return gel;
}

}  // namespace

const Gels& builtin_gels() {
    static const Gels gels = [] {
        Gels made;
        for (const LeeRow& row : kLeeRows)
            made.push_back(std::make_shared<const Gel>(
                Gel{row.name,
                    {{kTungsten, {row.tungsten_x, row.tungsten_y}, row.tungsten_percent / 100},
                     {kC, {row.c_x, row.c_y}, row.c_percent / 100}},
                    kLee}));
        return made;
    }();
    return gels;
}

Result<Gels> read_gels(std::string_view text) {
    if (text.size() > kMaxGelFileBytes) return Error{"too_large", "", "", "a file of gels has at most 1 MiB"};
    Gels gels;
    for (std::size_t number = 1; !text.empty(); ++number) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        const std::string_view line = trimmed(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        if (line.empty() || line.front() == '#') continue;
        const std::string place = "line " + std::to_string(number);
        auto read = read_line(line, place);
        if (!read) return read.error();
        const auto there = std::ranges::find(gels, read->name, [](const auto& gel) { return gel->name; });
        auto gel = with_line(there == gels.end() ? Gel{} : **there, std::move(*read), place);
        if (!gel) return gel.error();
        if (there != gels.end())
            *there = std::make_shared<const Gel>(std::move(*gel));
        else
            gels.push_back(std::make_shared<const Gel>(std::move(*gel)));
        if (gels.size() > kMaxGels)
            return Error{"too_large", place, "", "a file has at most " + std::to_string(kMaxGels) + " gels"};
    }
    return gels;
}

Gels all_gels(const Gels* more) {
    Gels all;
    for (const auto& gel : builtin_gels()) {
        const bool replaced =
            more != nullptr && std::ranges::any_of(*more, [&](const auto& one) { return one->name == gel->name; });
        if (!replaced) all.push_back(gel);
    }
    if (more != nullptr) all.insert(all.end(), more->begin(), more->end());
    return all;
}

std::shared_ptr<const Gel> find_gel(const Gels* more, std::string_view name) {
    const auto seek = [&](const auto& wanted) -> std::shared_ptr<const Gel> {
        for (const Gels* gels : {more, &builtin_gels()}) {
            if (gels == nullptr) continue;
            const auto at = std::ranges::find_if(*gels, wanted);
            if (at != gels->end()) return *at;
        }
        return nullptr;
    };
    auto gel = seek([&](const auto& one) { return one->name == name; });
    if (gel || name.empty()) return gel;
    return seek([&](const auto& one) { return one->name.starts_with(std::string(name) + " "); });
}

glm::dvec3 filtered_white(double cct_k, double duv, const Gel* gel) {
    const glm::dvec3 white = white_factors(cct_k, duv);
    if (gel == nullptr) return white;
    const GelMeasurement &warm = gel->measured.front(), &cold = gel->measured.back();
    const double from = mired_of(warm.of_xy), to = mired_of(cold.of_xy),
                 mired = 1e6 / (cct_k == 0 ? kWhiteCct_k : cct_k);
    const double t = from == to ? 0.0 : std::clamp((mired - from) / (to - from), 0.0, 1.0);
    const glm::dvec3 passed = white * glm::mix(filter_of(warm), filter_of(cold), t);
    const double luminance = luminance_of(passed);
    if (luminance < 1e-6) return glm::dvec3(0.0);  // nothing of this light passes
    return passed / luminance * glm::mix(warm.transmission_ratio, cold.transmission_ratio, t);
}

}  // namespace gonio
