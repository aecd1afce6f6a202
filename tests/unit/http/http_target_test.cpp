#include "server/http/http_target.h"
#include "protocol/schema/measure.pb.h"

#include <gtest/gtest.h>

namespace gonio {
namespace {

TEST(HttpTarget, PathsAndParametersAreDecoded) {
    const auto target = parse_target("/a%20b/%C3%BC?view=beauty&size=4%78%35&flag&&empty=");
    ASSERT_TRUE(target) << target.error().text();
    EXPECT_FALSE(target->authority);
    EXPECT_EQ(target->path, "/a b/ü");
    ASSERT_EQ(target->query.size(), 4u);
    EXPECT_EQ(target->query[0].name, "view");
    EXPECT_EQ(target->query[1].value, "4x5");
    EXPECT_EQ(target->query[2].name, "flag");
    EXPECT_EQ(target->query[3].value, "");
    EXPECT_EQ(parse_target("/x?a=1+1")->query[0].value, "1+1");
    EXPECT_EQ(parse_target("/x?a=b=c")->query[0].value, "b=c");
}

TEST(HttpTarget, AnAbsoluteTargetNamesItsHost) {
    const auto target = parse_target("http://localhost:8080/v1/frame.png?size=2x2");
    ASSERT_TRUE(target);
    EXPECT_EQ(*target->authority, "localhost:8080");
    EXPECT_TRUE(is_still(*target));
    EXPECT_EQ(parse_target("https://[::1]")->path, "/");
    EXPECT_EQ(parse_target("http://h?a=1")->query.size(), 1u);
}

TEST(HttpTarget, WhatIsNoTargetIsRefused) {
    for (const char* bad : {"", "*", "x", "localhost:80", "ftp://h/", "http:///x", "http://a@b/", "/%", "/%4", "/%zz",
                            "/%00", "/a%0a", "/%ff", "/%c0%af", "/x?a=%g1", "/x#y", "/\x01", "http://\x7f/"}) {
        const auto target = parse_target(bad);
        EXPECT_FALSE(target) << bad;
        if (!target) {
            EXPECT_EQ(target.error().code, "bad_target") << bad;
        }
    }
    EXPECT_EQ(parse_target("/" + std::string(kMaxTargetBytes, 'a')).error().code, "too_large");
    std::string many = "/x?a";
    for (std::size_t i = 1; i < kMaxParameters; ++i) many += "&a";
    EXPECT_TRUE(parse_target(many));
    EXPECT_FALSE(parse_target(many + "&a"));
}

TEST(HttpTarget, StillsSayWhatTheyWant) {
    const auto target = parse_target(
        "/v1/"
        "frame.exr?after_rev=12&size=640x480&view=illuminance&quality=reference&bounces=all&noise=0.05&openings=true&"
        "denoise=true&max_seconds=9.5");
    ASSERT_TRUE(target && is_still(*target));
    const auto query = still_query(*target);
    ASSERT_TRUE(query) << query.error().text();
    EXPECT_EQ(query->format(), "exr");
    EXPECT_EQ(query->after_rev(), 12u);
    EXPECT_EQ(query->width_px(), 640u);
    EXPECT_EQ(query->height_px(), 480u);
    EXPECT_EQ(query->view(), "illuminance");
    EXPECT_EQ(query->quality(), "reference");
    EXPECT_EQ(query->bounces(), "all");
    EXPECT_DOUBLE_EQ(query->noise_ratio(), 0.05);
    EXPECT_TRUE(query->denoise());
    EXPECT_DOUBLE_EQ(query->max_seconds(), 9.5);
    EXPECT_TRUE(query->openings());
    EXPECT_FALSE(still_query(*parse_target("/v1/frame.jpg"))->has_noise_ratio());
    const auto scene = parse_target("/v1/scene.glb?after_rev=3");
    ASSERT_TRUE(scene && is_still(*scene));
    EXPECT_EQ(still_query(*scene)->format(), "glb");
    EXPECT_EQ(still_query(*scene)->after_rev(), 3u);
    EXPECT_EQ(still_query(*parse_target("/v1/scene.mvr"))->format(), "mvr");
    EXPECT_EQ(still_query(*parse_target("/v1/scene.glb?view=beauty")).error().where, "view");
    for (const char* other : {"/v1/scene", "/v1/scene.png", "/v1/frame.glb", "/v1/frame", "/v1/frame.gif",
                              "/v1/frame.png/", "/v1/frame.PNG", "/frame.png"})
        EXPECT_FALSE(is_still(*parse_target(other))) << other;
}

TEST(HttpTarget, ParametersOfStillsAreCheckedByNameAndValue) {
    const struct {
        const char *query, *name, *value;
    } rows[] = {{"width=3", "width", "3"},
                {"size=4x4&size=4x4", "size", "4x4"},
                {"after_rev=-1", "after_rev", "-1"},
                {"after_rev=", "after_rev", ""},
                {"after_rev=4294967296", "after_rev", "4294967296"},
                {"size=12", "size", "12"},
                {"size=0x4", "size", "0x4"},
                {"size=4x4x4", "size", "4x4x4"},
                {"size=%2B4x4", "size", "+4x4"},
                {"noise=little", "noise", "little"},
                {"noise=inf", "noise", "inf"},
                {"view=", "view", ""},
                {"openings=yes", "openings", "yes"},
                {"After_rev=1", "After_rev", "1"}};
    for (const auto& row : rows) {
        const auto query = still_query(*parse_target(std::string("/v1/frame.png?") + row.query));
        ASSERT_FALSE(query) << row.query;
        EXPECT_EQ(query.error().code, "invalid_argument");
        EXPECT_EQ(query.error().where, row.name) << row.query;
        EXPECT_EQ(query.error().value, row.value) << row.query;
    }
}

TEST(HttpTarget, UploadsHaveNames) {
    EXPECT_EQ(upload_name(*parse_target("/v1/uploads/room.glb")), "room.glb");
    EXPECT_EQ(upload_name(*parse_target("/v1/uploads/..%2Fx.glb")), "../x.glb");  // the store refuses it
    EXPECT_FALSE(upload_name(*parse_target("/v1/uploads")));
}

}  // namespace
}  // namespace gonio
