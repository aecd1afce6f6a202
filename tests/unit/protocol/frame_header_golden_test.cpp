// The frame header's bytes are a contract with the page and with other people's clients.
#include <gtest/gtest.h>

#include "protocol/schema/frame_header.h"

namespace gonio {
namespace {

// The example of PROTOCOL.md.
constexpr unsigned char kGolden[] = {
    0x02, 0x01, 0x03, 0x05,                          // kind, version, flags key + final, lane
    0x04, 0x03, 0x02, 0x01,                          // seq 0x01020304
    0x2a, 0x00, 0x00, 0x00,                          // scene_rev 42
    0x00, 0x00, 0x00, 0x00,                          // reserved
    0x08, 0x07, 0x06, 0x05, 0x04, 0x03, 0x02, 0x01,  // rendered_ns 0x0102030405060708
    0x10, 0x27, 0x00, 0x00,                          // render_us 10000
    0xd2, 0x04, 0x00, 0x00,                          // encode_us 1234
};

FrameHeader golden_header() {
    return {true, true, 5, 0x01020304, 42, 0x0102030405060708, 10000, 1234};
}

TEST(FrameHeader, GoldenBytes) {
    const auto bytes = encode_frame_header(golden_header());
    ASSERT_EQ(bytes.size(), sizeof kGolden);
    for (std::size_t i = 0; i < bytes.size(); ++i)
        EXPECT_EQ(std::to_integer<int>(bytes[i]), kGolden[i]) << "byte " << i;
}

TEST(FrameHeader, ComesBack) {
    const auto header = decode_frame_header(std::as_bytes(std::span(kGolden)));
    ASSERT_TRUE(header) << header.error().text();
    EXPECT_TRUE(header->key);
    EXPECT_TRUE(header->final);
    EXPECT_EQ(header->lane, 5);
    EXPECT_EQ(header->seq, 0x01020304u);
    EXPECT_EQ(header->scene_rev, 42u);
    EXPECT_EQ(header->rendered_ns, 0x0102030405060708u);
    EXPECT_EQ(header->render_us, 10000u);
    EXPECT_EQ(header->encode_us, 1234u);
    const auto plain = decode_frame_header(encode_frame_header({}));
    ASSERT_TRUE(plain);
    EXPECT_FALSE(plain->key || plain->final);
}

TEST(FrameHeader, LaterFlagsAndReservedBytesAreIgnored) {
    auto bytes = encode_frame_header(golden_header());
    bytes[2] = std::byte{0xff};
    bytes[12] = std::byte{1};
    const auto header = decode_frame_header(bytes);
    ASSERT_TRUE(header);
    EXPECT_EQ(header->seq, 0x01020304u);
}

TEST(FrameHeader, RefusalsSayWhere) {
    auto bytes = encode_frame_header(golden_header());
    const auto refused_at = [](std::span<const std::byte> data) {
        const auto header = decode_frame_header(data);
        EXPECT_FALSE(header);
        EXPECT_EQ(header.error().code, "bad_frame_header");
        return header.error().where;
    };
    EXPECT_EQ(refused_at(std::span(bytes).first(31)), "byte 31");
    EXPECT_EQ(refused_at({}), "byte 0");
    bytes[0] = std::byte{1};
    EXPECT_EQ(refused_at(bytes), "byte 0");
    bytes[0] = std::byte{2};
    bytes[1] = std::byte{9};
    EXPECT_EQ(refused_at(bytes), "byte 1");
}

}  // namespace
}  // namespace gonio
