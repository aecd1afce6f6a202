#include "server/stream/h264_stream.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace gonio {
namespace {

constexpr unsigned kSpsType = 7;
constexpr std::size_t kMostSpsBytes = 256;

// Bits of an RBSP, with Exp-Golomb codes (ITU-T H.264 9.1). Past the end it reads zeros and says so.
class Bits {
public:
    explicit Bits(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {}
    unsigned u(int count) {
        unsigned value = 0;
        for (; count > 0; --count, ++position_) {
            if (position_ / 8 >= bytes_.size()) {
                ended_ = true;
                return 0;
            }
            value = value << 1 | (bytes_[position_ / 8] >> (7 - position_ % 8) & 1u);
        }
        return value;
    }
    unsigned ue() {
        int zeros = 0;
        while (u(1) == 0) {
            if (ended_ || ++zeros > 31) return 0;
        }
        return (1u << zeros) - 1 + u(zeros);
    }
    void skip_se() { ue(); }  // the same code word, read as signed
    bool ended() const { return ended_; }

private:
    std::vector<std::uint8_t> bytes_;
    std::size_t position_ = 0;
    bool ended_ = false;
};

constexpr unsigned kProfilesWithChromaFormat[] = {100, 110, 122, 244, 44, 83, 86, 118, 128};

// sps: from profile_idc on, without emulation prevention.
std::optional<StreamInfo> read_sps(std::vector<std::uint8_t> sps) {
    if (sps.size() < 4) return std::nullopt;
    StreamInfo info;
    char codec[16];
    std::snprintf(codec, sizeof codec, "avc1.%02X%02X%02X", sps[0], sps[1], sps[2]);
    info.codec = codec;
    Bits bits(std::move(sps));
    const unsigned profile = bits.u(8);
    bits.u(16);
    bits.ue();  // seq_parameter_set_id
    unsigned chroma_format = 1;
    if (std::ranges::count(kProfilesWithChromaFormat, profile) > 0) {
        chroma_format = bits.ue();
        if (chroma_format == 3) bits.u(1);
        bits.ue();
        bits.ue();
        bits.u(1);
        if (bits.u(1)) return info;  // scaling matrices
    }
    bits.ue();  // log2_max_frame_num_minus4
    const unsigned order_type = bits.ue();
    if (order_type == 0) {
        bits.ue();
    } else if (order_type == 1) {
        bits.u(1);
        bits.skip_se();
        bits.skip_se();
        for (unsigned count = bits.ue(); count > 0 && !bits.ended(); --count) bits.skip_se();
    }
    bits.ue();  // max_num_ref_frames
    bits.u(1);
    const unsigned width_mbs = bits.ue() + 1, height_units = bits.ue() + 1, frame_mbs_only = bits.u(1);
    if (!frame_mbs_only) bits.u(1);
    bits.u(1);  // direct_8x8_inference_flag
    unsigned left = 0, right = 0, top = 0, bottom = 0;
    if (bits.u(1)) left = bits.ue(), right = bits.ue(), top = bits.ue(), bottom = bits.ue();
    if (bits.ended() || width_mbs > 1024 || height_units > 1024) return std::nullopt;
    const unsigned crop_x = chroma_format == 1 || chroma_format == 2 ? 2 : 1;
    const unsigned crop_y = (chroma_format == 1 ? 2 : 1) * (2 - frame_mbs_only);
    info.width_px = static_cast<int>(16 * width_mbs) - static_cast<int>(crop_x * (left + right));
    info.height_px =
        static_cast<int>(16 * height_units * (2 - frame_mbs_only)) - static_cast<int>(crop_y * (top + bottom));
    return info;
}

}  // namespace

std::optional<StreamInfo> read_stream_info(std::span<const std::byte> access_unit) {
    const auto at = [&](std::size_t i) { return std::to_integer<std::uint8_t>(access_unit[i]); };
    for (std::size_t i = 0; i + 4 <= access_unit.size(); ++i) {
        if (at(i) != 0 || at(i + 1) != 0 || at(i + 2) != 1 || (at(i + 3) & 0x1fu) != kSpsType) continue;
        std::vector<std::uint8_t> sps;
        for (std::size_t j = i + 4; j < access_unit.size() && sps.size() < kMostSpsBytes; ++j) {
            if (j + 2 < access_unit.size() && at(j) == 0 && at(j + 1) == 0 && at(j + 2) <= 1) break;
            if (at(j) == 3 && at(j - 1) == 0 && at(j - 2) == 0) continue;  // emulation prevention
            sps.push_back(at(j));
        }
        return read_sps(std::move(sps));
    }
    return std::nullopt;
}

int level_idc(int width_px, int height_px, int fps) {
    struct Row {
        int level_idc;
        std::int64_t macroblocks_per_s, macroblocks;
    };
    constexpr Row rows[] = {{10, 1485, 99},        {11, 3000, 396},      {12, 6000, 396},       {13, 11880, 396},
                            {21, 19800, 792},      {22, 20250, 1620},    {30, 40500, 1620},     {31, 108000, 3600},
                            {32, 216000, 5120},    {40, 245760, 8192},   {42, 522240, 8704},    {50, 589824, 22080},
                            {51, 983040, 36864},   {52, 2073600, 36864}, {60, 4177920, 139264}, {61, 8355840, 139264},
                            {62, 16711680, 139264}};
    const std::int64_t width = (width_px + 15) / 16, height = (height_px + 15) / 16, size = width * height;
    for (const Row& row : rows) {
        // A.3.1: neither side may be longer than sqrt(8 MaxFS) macroblocks.
        if (size <= row.macroblocks && size * fps <= row.macroblocks_per_s && width * width <= 8 * row.macroblocks &&
            height * height <= 8 * row.macroblocks)
            return row.level_idc;
    }
    return 62;
}

}  // namespace gonio
