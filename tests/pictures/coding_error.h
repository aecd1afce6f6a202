// How far a decoded picture is from the one that was encoded.
#pragma once

#include <cstdint>
#include <vector>

namespace gonio::test {

struct CodingError {
    double y_db = 0.0;    // PSNR of Y', dB; 100 where nothing differs
    double rgb_db = 0.0;  // PSNR of R'G'B', dB
    // Blocks on plain surfaces, in codes of 8 bits: of neighbouring blocks of 8×8 in which the encoded Y' spans at most
    // kPlainCodes, by how much the means of their errors differ; the 99th percentile. 0 where there are none.
    double plain_step = 0.0;
    double flip = 0.0;              // mean FLIP (tests/gl/flip.h); 0 where it was not asked for
    double worst_block_flip = 0.0;  // the greatest mean over a block of 8×8
};
inline constexpr int kPlainCodes = 8;

// Both NV12 as Picture::nv12, of the same size. with_flip: most of a second of a core for 800×800.
CodingError coding_error(const std::vector<std::uint8_t>& encoded, const std::vector<std::uint8_t>& decoded,
                         int width_px, int height_px, bool with_flip);

// What is called visually lossless here: below what the least step of 8 bits does. A grey that is one code off has a
// FLIP of 0.03 (gl.Flip): two thirds of it in the mean of the picture, and no block of 8×8 with more than twice of it.
inline constexpr double kLosslessDb = 45.0, kLosslessFlip = 0.02, kLosslessBlockFlip = 0.06;
bool visually_lossless(const CodingError& error);

}  // namespace gonio::test
