#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "server/base/clock.h"
#include "server/stream/encoder.h"

// jpeglib.h needs FILE and size_t declared before it.
#include <jpeglib.h>

namespace gonio {
namespace {

constexpr int kFractionBits = 16;

// The picture is BT.709 limited range, a JPEG file is BT.601 full range (JFIF). Both are linear maps of the same
// R'G'B', so one matrix leads from the first to the second; grey stays grey, hence only Y' depends on Y. With K the
// luma weights: R = Y + 2(1-Kr)Cr, B = Y + 2(1-Kb)Cb, G = (Y - Kr R - Kb B)/Kg (ITU-R BT.709-6 item 3).
struct ColorMatrix {
    int y_from_y, y_from_cb, y_from_cr, cb_from_cb, cb_from_cr, cr_from_cb, cr_from_cr;  // 16 fraction bits
};

constexpr int fixed(double value) {
    return static_cast<int>(value * (1 << kFractionBits) + (value < 0 ? -0.5 : 0.5));
}

constexpr ColorMatrix make_matrix() {
    constexpr double kr = 0.2126, kb = 0.0722, kg = 1 - kr - kb;  // BT.709
    constexpr double jr = 0.299, jb = 0.114, jg = 1 - jr - jb;    // BT.601
    constexpr double luma = 255.0 / 219, chroma = 255.0 / 224;    // limited -> full range
    const double r_cr = 2 * (1 - kr) * chroma, b_cb = 2 * (1 - kb) * chroma;
    const double g_cr = -kr * r_cr / kg, g_cb = -kb * b_cb / kg;
    const double y_cb = jg * g_cb + jb * b_cb, y_cr = jr * r_cr + jg * g_cr;
    const double cb = 0.5 / (1 - jb), cr = 0.5 / (1 - jr);
    return {fixed(luma),
            fixed(y_cb),
            fixed(y_cr),
            fixed(cb * (b_cb - y_cb)),
            fixed(-cb * y_cr),
            fixed(-cr * y_cb),
            fixed(cr * (r_cr - y_cr))};
}

constexpr ColorMatrix kMatrix = make_matrix();

std::uint8_t clamped(int fixed_value) {
    return static_cast<std::uint8_t>(std::clamp((fixed_value + (1 << (kFractionBits - 1))) >> kFractionBits, 0, 255));
}

constexpr std::size_t kMcu = 16;  // pixels a side of one 4:2:0 unit

// One band of 16 pixel rows as libjpeg's raw interface takes it, padded to whole units by repeating the last column and
// row.
struct Band {
    explicit Band(std::size_t padded_width)
        : width(padded_width), y(kMcu * width), cb(kMcu / 2 * width / 2), cr(kMcu / 2 * width / 2) {
        for (std::size_t row = 0; row < kMcu; ++row) y_rows[row] = y.data() + row * width;
        for (std::size_t row = 0; row < kMcu / 2; ++row) {
            cb_rows[row] = cb.data() + row * width / 2;
            cr_rows[row] = cr.data() + row * width / 2;
        }
        planes[0] = y_rows;
        planes[1] = cb_rows;
        planes[2] = cr_rows;
    }
    std::size_t width;
    std::vector<std::uint8_t> y, cb, cr;
    JSAMPROW y_rows[kMcu], cb_rows[kMcu / 2], cr_rows[kMcu / 2];
    JSAMPARRAY planes[3];
};

void fill_band(Band& band, const Picture& picture, std::size_t first_row) {
    const auto width = static_cast<std::size_t>(picture.width_px), height = static_cast<std::size_t>(picture.height_px);
    const std::uint8_t* luma = picture.nv12->data();
    const std::uint8_t* chroma = luma + width * height;
    for (std::size_t pair = 0; pair < kMcu / 2; ++pair) {
        const std::size_t source_pair = std::min(first_row / 2 + pair, height / 2 - 1);
        const std::uint8_t* y0 = luma + source_pair * 2 * width;
        const std::uint8_t* c = chroma + source_pair * width;
        std::uint8_t* out0 = band.y_rows[pair * 2];
        std::uint8_t* out1 = band.y_rows[pair * 2 + 1];
        std::uint8_t* out_cb = band.cb_rows[pair];
        std::uint8_t* out_cr = band.cr_rows[pair];
        for (std::size_t x = 0; x < width; x += 2) {
            const int cb = c[x] - 128, cr = c[x + 1] - 128;
            const int y_offset = kMatrix.y_from_cb * cb + kMatrix.y_from_cr * cr - 16 * kMatrix.y_from_y;
            out0[x] = clamped(kMatrix.y_from_y * y0[x] + y_offset);
            out0[x + 1] = clamped(kMatrix.y_from_y * y0[x + 1] + y_offset);
            out1[x] = clamped(kMatrix.y_from_y * y0[width + x] + y_offset);
            out1[x + 1] = clamped(kMatrix.y_from_y * y0[width + x + 1] + y_offset);
            out_cb[x / 2] = clamped(kMatrix.cb_from_cb * cb + kMatrix.cb_from_cr * cr + (128 << kFractionBits));
            out_cr[x / 2] = clamped(kMatrix.cr_from_cb * cb + kMatrix.cr_from_cr * cr + (128 << kFractionBits));
        }
        std::memset(out0 + width, out0[width - 1], band.width - width);
        std::memset(out1 + width, out1[width - 1], band.width - width);
        std::memset(out_cb + width / 2, out_cb[width / 2 - 1], (band.width - width) / 2);
        std::memset(out_cr + width / 2, out_cr[width / 2 - 1], (band.width - width) / 2);
    }
}

struct ErrorManager {
    jpeg_error_mgr base;
    std::jmp_buf escape;
    char message[JMSG_LENGTH_MAX];
};

[[noreturn]] void escape_error(j_common_ptr jpeg) {
    auto* manager = reinterpret_cast<ErrorManager*>(jpeg->err);
    manager->base.format_message(jpeg, manager->message);
    std::longjmp(manager->escape, 1);
}

// Fills `memory` (malloc, owned by the caller also on failure). No object with a destructor lives here: libjpeg reports
// errors by longjmp; so it has seven parameters.
bool compress(jpeg_compress_struct& jpeg, ErrorManager& errors, const Picture& picture, int quality_percent, Band& band,
              unsigned char*& memory, unsigned long& size) {
    jpeg.err = jpeg_std_error(&errors.base);
    errors.base.error_exit = escape_error;
    if (setjmp(errors.escape)) {
        jpeg_destroy_compress(&jpeg);
        return false;
    }
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &memory, &size);
    jpeg.image_width = static_cast<JDIMENSION>(picture.width_px);
    jpeg.image_height = static_cast<JDIMENSION>(picture.height_px);
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_YCbCr;
    jpeg_set_defaults(&jpeg);  // 4:2:0
    jpeg_set_quality(&jpeg, quality_percent, TRUE);
    jpeg.raw_data_in = TRUE;
    jpeg.dct_method = JDCT_ISLOW;
    jpeg_start_compress(&jpeg, TRUE);
    while (jpeg.next_scanline < jpeg.image_height) {
        fill_band(band, picture, jpeg.next_scanline);
        jpeg_write_raw_data(&jpeg, band.planes, kMcu);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    return true;
}

}  // namespace

Result<EncodedFrame> encode_jpeg_frame(const Picture& picture, int quality_percent) {
    const auto width = static_cast<std::size_t>(std::max(0, picture.width_px));
    const auto height = static_cast<std::size_t>(std::max(0, picture.height_px));
    const std::string size_text = std::to_string(picture.width_px) + "x" + std::to_string(picture.height_px);
    if (width < 2 || height < 2 || width % 2 || height % 2 || !picture.nv12 ||
        picture.nv12->size() != width * height * 3 / 2)
        return Error{"encoder_failed", "jpeg", size_text, "The picture's size must be even and match its bytes."};
    Band band((width + kMcu - 1) / kMcu * kMcu);
    jpeg_compress_struct jpeg{};
    ErrorManager errors{};
    unsigned char* memory = nullptr;
    unsigned long size = 0;
    const bool done = compress(jpeg, errors, picture, std::clamp(quality_percent, 1, 100), band, memory, size);
    EncodedFrame frame;
    const auto* bytes = reinterpret_cast<const std::byte*>(memory);
    if (done) frame.data.assign(bytes, bytes + size);
    std::free(memory);
    if (!done) return Error{"encoder_failed", "jpeg", size_text, errors.message};
    frame.key = true;
    frame.scene_rev = picture.scene_rev;
    frame.drained_ns = picture.drained_ns;
    frame.rendered_ns = picture.rendered_ns;
    frame.encoded_ns = monotonic_ns();
    return frame;
}

}  // namespace gonio
