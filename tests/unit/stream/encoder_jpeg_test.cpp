// The MJPEG fallback shows the same colours as the H.264 stream although JPEG knows only BT.601 full range.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "server/stream/encoder.h"

#include <jpeglib.h>

namespace gonio {
namespace {

struct Rgb {
    int r, g, b;
};

// A flat picture: BT.709 limited range from R'G'B' 0..255 (ITU-R BT.709-6 items 3.2, 3.4).
Picture flat_picture(int width, int height, Rgb rgb) {
    const double r = rgb.r / 255.0, g = rgb.g / 255.0, b = rgb.b / 255.0;
    const double luma = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    const auto y = static_cast<std::uint8_t>(std::lround(16 + 219 * luma));
    const auto cb = static_cast<std::uint8_t>(std::lround(128 + 224 * (b - luma) / 1.8556));
    const auto cr = static_cast<std::uint8_t>(std::lround(128 + 224 * (r - luma) / 1.5748));
    const auto pixels = static_cast<std::size_t>(width * height);
    auto nv12 = std::make_shared<std::vector<std::uint8_t>>(pixels * 3 / 2, y);
    for (std::size_t i = pixels; i < nv12->size(); i += 2) {
        (*nv12)[i] = cb;
        (*nv12)[i + 1] = cr;
    }
    Picture picture;
    picture.scene_rev = 7;
    picture.width_px = width;
    picture.height_px = height;
    picture.nv12 = nv12;
    return picture;
}

std::vector<std::uint8_t> decode_rgb(const EncodedFrame& frame, int& width, int& height) {
    jpeg_decompress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_decompress(&jpeg);
    jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(frame.data.data()), frame.data.size());
    jpeg_read_header(&jpeg, TRUE);
    jpeg.out_color_space = JCS_RGB;
    jpeg_start_decompress(&jpeg);
    width = static_cast<int>(jpeg.output_width);
    height = static_cast<int>(jpeg.output_height);
    std::vector<std::uint8_t> rgb(static_cast<std::size_t>(width * height * 3));
    while (jpeg.output_scanline < jpeg.output_height) {
        JSAMPROW row = rgb.data() + jpeg.output_scanline * static_cast<std::size_t>(width) * 3;
        jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);
    jpeg_destroy_decompress(&jpeg);
    return rgb;
}

TEST(JpegFrame, PureColoursComeBack) {
    // 4/255: two quantisations to 8 bits (limited-range chroma steps are 1.1 to 2.1 of 255 wide) and the JPEG's own.
    constexpr int kTolerance = 4;
    const Rgb colours[] = {{0, 0, 0},   {255, 255, 255}, {128, 128, 128}, {255, 0, 0},   {0, 255, 0},
                           {0, 0, 255}, {255, 255, 0},   {0, 255, 255},   {255, 0, 255}, {200, 90, 30}};
    for (const Rgb& colour : colours) {
        auto frame = encode_jpeg_frame(flat_picture(70, 50, colour), 95);  // not whole units
        ASSERT_TRUE(frame) << frame.error().text();
        int width = 0, height = 0;
        const auto rgb = decode_rgb(*frame, width, height);
        ASSERT_EQ(width, 70);
        ASSERT_EQ(height, 50);
        for (std::size_t i = 0; i < rgb.size(); i += 3) {
            ASSERT_NEAR(rgb[i], colour.r, kTolerance) << "pixel " << i / 3;
            ASSERT_NEAR(rgb[i + 1], colour.g, kTolerance);
            ASSERT_NEAR(rgb[i + 2], colour.b, kTolerance);
        }
        EXPECT_EQ(frame->scene_rev, 7u);
        EXPECT_TRUE(frame->key);
    }
}

TEST(JpegFrame, PlacesStay) {
    Picture picture = flat_picture(64, 64, {0, 0, 0});
    auto nv12 = std::make_shared<std::vector<std::uint8_t>>(*picture.nv12);
    for (std::size_t y = 0; y < 32; ++y)
        for (std::size_t x = 32; x < 64; ++x) (*nv12)[y * 64 + x] = 235;  // upper right white
    picture.nv12 = nv12;
    auto frame = encode_jpeg_frame(picture, 90);
    ASSERT_TRUE(frame);
    int width = 0, height = 0;
    const auto rgb = decode_rgb(*frame, width, height);
    EXPECT_GT(rgb[(10 * 64 + 50) * 3], 245);
    EXPECT_LT(rgb[(10 * 64 + 10) * 3], 10);
    EXPECT_LT(rgb[(50 * 64 + 50) * 3], 10);
}

TEST(JpegFrame, IsQuick) {
    const Picture picture = flat_picture(800, 800, {200, 90, 30});
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(encode_jpeg_frame(picture, 80));
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count() / 10;
    RecordProperty("ms", std::to_string(ms));
}

TEST(JpegFrame, WrongSizesAreRefused) {
    Picture picture = flat_picture(64, 64, {0, 0, 0});
    picture.height_px = 66;
    auto frame = encode_jpeg_frame(picture, 80);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, "encoder_failed");
    EXPECT_FALSE(encode_jpeg_frame(Picture{}, 80));
}

}  // namespace
}  // namespace gonio
