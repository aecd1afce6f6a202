#include "protocol/schema/palette.h"

#include <algorithm>

namespace gonio {
namespace {

constexpr Rgb8 kClassic[] = {
    {39, 39, 97},    {43, 54, 112},   {46, 66, 124},   {49, 76, 135},   {53, 85, 145},   {55, 92, 155},
    {58, 99, 163},   {61, 105, 171},  {63, 111, 179},  {63, 121, 177},  {63, 130, 174},  {63, 139, 172},
    {63, 147, 170},  {63, 154, 167},  {63, 161, 165},  {63, 167, 162},  {63, 173, 160},  {94, 178, 153},
    {116, 182, 146}, {134, 187, 139}, {149, 191, 130}, {162, 195, 122}, {174, 199, 112}, {185, 203, 101},
    {196, 206, 89},  {204, 212, 120}, {213, 218, 143}, {220, 223, 162}, {227, 228, 179}, {232, 232, 194},
    {236, 235, 207}, {239, 237, 220}, {242, 240, 229},
};
// viridis of matplotlib (CC0).
constexpr Rgb8 kViridis[] = {
    {68, 1, 84},    {72, 40, 120},  {62, 73, 137},  {49, 104, 142}, {38, 130, 142},
    {31, 158, 137}, {53, 183, 121}, {110, 206, 88}, {181, 222, 43}, {253, 231, 37},
};
// Radiance's `spec` (falsecolor): 1.6 x - 0.6, 8/3 x and from 3/8 on 1.6 - 1.6 x, 1 - 8/3 x, to the power of 1/2.2.
constexpr Rgb8 kSpectral[] = {
    {0, 0, 255},   {0, 82, 245},  {0, 113, 235}, {0, 136, 224}, {0, 155, 212}, {0, 171, 200}, {0, 186, 186},
    {0, 200, 171}, {0, 212, 155}, {0, 224, 136}, {0, 235, 113}, {0, 245, 82},  {0, 255, 0},   {65, 249, 0},
    {90, 243, 0},  {108, 237, 0}, {123, 230, 0}, {136, 224, 0}, {148, 217, 0}, {158, 210, 0}, {168, 202, 0},
    {177, 194, 0}, {186, 186, 0}, {194, 177, 0}, {202, 168, 0}, {210, 158, 0}, {217, 148, 0}, {224, 136, 0},
    {230, 123, 0}, {237, 108, 0}, {243, 90, 0},  {249, 65, 0},  {255, 0, 0},
};
constexpr Rgb8 kGray[] = {
    {0, 0, 0},
    {255, 255, 255},
};
// RdBu of ColorBrewer (Apache 2.0), turned over.
constexpr Rgb8 kDifference[] = {
    {5, 48, 97},     {33, 102, 172},  {67, 147, 195}, {146, 197, 222}, {209, 229, 240}, {247, 247, 247},
    {253, 219, 199}, {244, 165, 130}, {214, 96, 77},  {178, 24, 43},   {103, 0, 31},
};

constexpr Palette kPalettes[] = {
    {"classic", "dark blue over green and yellow to white", kClassic, {0, 0, 0}, {255, 64, 32}},
    {"viridis",
     "lightness ascends evenly: for print and for colour-blind readers",
     kViridis,
     {0, 0, 0},
     {255, 255, 255}},
    {"spectral", "blue, green, red, as Radiance's spec", kSpectral, {0, 0, 0}, {255, 255, 255}},
    {"gray", "black to white", kGray, {32, 64, 176}, {208, 40, 40}},
};
constexpr Palette kOfDifferences = {
    "difference", "blue: less, white: the same, red: more", kDifference, {0, 220, 255}, {255, 214, 0}};

std::string array_of(const Rgb8& color) {
    return "[" + std::to_string(color[0]) + "," + std::to_string(color[1]) + "," + std::to_string(color[2]) + "]";
}

}  // namespace

std::span<const Palette> palettes() {
    return kPalettes;
}

const Palette& difference_palette() {
    return kOfDifferences;
}

const Palette* find_palette(std::string_view name) {
    const auto found = std::ranges::find(kPalettes, name, &Palette::name);
    return found == std::end(kPalettes) ? nullptr : found;
}

std::array<float, 3> color_at(const Palette& palette, float t) {
    const float at = std::clamp(t, 0.0f, 1.0f) * static_cast<float>(palette.stops.size() - 1);
    const std::size_t low = std::min(static_cast<std::size_t>(at), palette.stops.size() - 2);
    const float share = at - static_cast<float>(low);
    std::array<float, 3> color{};
    for (std::size_t k = 0; k < 3; ++k) {
        const auto from = static_cast<float>(palette.stops[low][k]), to = static_cast<float>(palette.stops[low + 1][k]);
        color[k] = from + (to - from) * share;
    }
    return color;
}

std::string palettes_module() {
    std::string text = "export const belowMark = " + array_of(kBelowMark) + ";\nexport const palettes = {\n";
    const auto put = [&](const Palette& palette) {
        text += "  \"" + std::string(palette.name) + "\": {help: \"" + std::string(palette.help) +
                "\", under: " + array_of(palette.under) + ", over: " + array_of(palette.over) + ", colors: [";
        for (std::size_t i = 0; i < kPaletteColors; ++i) {
            const auto color = color_at(palette, static_cast<float>(i) / (kPaletteColors - 1));
            text += (i > 0 ? "," : "") +
                    array_of({static_cast<std::uint8_t>(color[0] + 0.5f), static_cast<std::uint8_t>(color[1] + 0.5f),
                              static_cast<std::uint8_t>(color[2] + 0.5f)});
        }
        text += "]},\n";
    };
    for (const Palette& palette : kPalettes) put(palette);
    put(kOfDifferences);
    return text + "};\n";
}

}  // namespace gonio
