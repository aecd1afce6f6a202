#include "server/bake/ktx.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gonio::bake {
namespace {

constexpr int kMantissaBits = 9, kBias = 15, kMostExponent = 31;
constexpr float kGreatest = 65408.0f;   // (2⁹ − 1) / 2⁹ · 2¹⁶
constexpr std::uint32_t kFormat = 123;  // VK_FORMAT_E5B9G9R9_UFLOAT_PACK32

void put(std::string& bytes, std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes.push_back(static_cast<char>(value >> (8 * i) & 0xFF));
}

}  // namespace

std::uint32_t pack_rgb9e5(const glm::vec3& rgb) {
    const glm::vec3 c = glm::clamp(rgb, glm::vec3(0.0f), glm::vec3(kGreatest));
    const float greatest = std::max({c.r, c.g, c.b});
    if (!(greatest > 0.0f)) return 0;
    int exponent = std::max(-kBias - 1, static_cast<int>(std::floor(std::log2(greatest)))) + 1 + kBias;
    float unit = std::ldexp(1.0f, exponent - kBias - kMantissaBits);
    if (std::floor(greatest / unit + 0.5f) >= 512.0f) unit *= 2.0f, ++exponent;
    exponent = std::min(exponent, kMostExponent);
    std::uint32_t bits = static_cast<std::uint32_t>(exponent) << 27;
    for (int i = 0; i < 3; ++i)
        bits |= std::min(static_cast<std::uint32_t>(std::floor(c[i] / unit + 0.5f)), 511u) << (kMantissaBits * i);
    return bits;
}

glm::vec3 unpack_rgb9e5(std::uint32_t bits) {
    const float unit = std::ldexp(1.0f, static_cast<int>(bits >> 27) - kBias - kMantissaBits);
    return unit * glm::vec3(static_cast<float>(bits & 511u), static_cast<float>(bits >> 9 & 511u),
                            static_cast<float>(bits >> 18 & 511u));
}

std::string ktx2_rgb9e5(std::span<const float> picture, int width, int height, float scale) {
    // The basic data format descriptor (Khronos Data Format 1.3, section 5 and its table of E5B9G9R9): of each channel
    // a sample of its mantissa and one of the exponent that they share.
    std::string samples;
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
        put(samples, static_cast<std::uint64_t>(kMantissaBits) * channel, 2);
        put(samples, kMantissaBits - 1, 1);
        put(samples, channel, 1);
        put(samples, 0, 4);
        put(samples, 0, 4);
        put(samples, 8448, 4);  // as that table has it
        put(samples, 27, 2);
        put(samples, 5 - 1, 1);
        put(samples, channel | 0x20u, 1);  // KHR_DF_SAMPLE_DATATYPE_EXPONENT
        put(samples, 0, 4);
        put(samples, kBias, 4);
        put(samples, kMostExponent, 4);
    }
    std::string descriptor;
    put(descriptor, 0, 4);  // vendor Khronos, basic
    put(descriptor, 2, 2);  // KHR_DF_VERSIONNUMBER_1_3
    put(descriptor, 24 + samples.size(), 2);
    put(descriptor, 1, 1);  // model RGBSDA
    put(descriptor, 1, 1);  // primaries of BT.709
    put(descriptor, 1, 1);  // linear
    put(descriptor, 0, 1);
    put(descriptor, 0, 4);  // blocks of one texel
    put(descriptor, 4, 8);  // of 4 bytes, in one plane
    descriptor += samples;
    const std::string key = "KTXwriter", writer = "gonio", note = "KTXorientation", way = "rd";
    std::string values;
    for (const auto& [name, text] : {std::pair(note, way), std::pair(key, writer)}) {
        put(values, name.size() + text.size() + 2, 4);
        values += name + '\0' + text + '\0';
        values.resize((values.size() + 3) / 4 * 4, '\0');
    }
    constexpr std::size_t kHead = 12 + 9 * 4 + 4 * 4 + 2 * 8 + 24;
    const std::size_t descriptor_at = kHead, values_at = descriptor_at + 4 + descriptor.size(),
                      data_at = (values_at + values.size() + 3) / 4 * 4,
                      data_size = 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::string bytes("\xABKTX 20\xBB\r\n\x1A\n", 12);
    // Format, size of its type, width, height, depth, layers, faces, levels, no supercompression.
    for (const std::size_t value :
         {std::size_t{kFormat}, std::size_t{4}, static_cast<std::size_t>(width), static_cast<std::size_t>(height),
          std::size_t{0}, std::size_t{0}, std::size_t{1}, std::size_t{1}, std::size_t{0}, descriptor_at,
          4 + descriptor.size(), values_at, values.size()})
        put(bytes, value, 4);
    for (const std::size_t value : {std::size_t{0}, std::size_t{0}, data_at, data_size, data_size})
        put(bytes, value, 8);
    put(bytes, 4 + descriptor.size(), 4);
    bytes += descriptor + values;
    bytes.resize(data_at, '\0');
    for (std::size_t i = 0; i + 2 < picture.size(); i += 3)
        put(bytes, pack_rgb9e5(scale * glm::vec3(picture[i], picture[i + 1], picture[i + 2])), 4);
    return bytes;
}

}  // namespace gonio::bake
