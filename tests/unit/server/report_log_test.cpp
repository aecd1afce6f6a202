#include "server/session/report_log.h"
#include "protocol/schema/report.pb.h"

#include <gtest/gtest.h>

namespace gonio {
namespace {

v1::FrameReport report_of(std::uint32_t rev, double frame_ms = 0) {
    v1::FrameReport report;
    report.set_scene_rev(rev);
    report.set_frame_ms(frame_ms);
    return report;
}

Work query_of(std::uint32_t session) {
    Work work;
    work.session = session;
    return work;
}

TEST(ReportLogTest, KeepsTheFirstFrameOfARevision) {
    ReportLog log;
    EXPECT_EQ(log.find(1), nullptr);
    log.keep(report_of(3, 7.0));
    log.keep(report_of(3, 1.0));
    log.keep(report_of(5, 2.0));
    EXPECT_EQ(log.find(3)->frame_ms(), 7.0);
    EXPECT_EQ(log.find(4)->scene_rev(), 5u) << "the first that contains it";
    EXPECT_EQ(log.find(6), nullptr);
}

TEST(ReportLogTest, KeepsTheNewestUpToItsBound) {
    ReportLog log;
    for (std::uint32_t rev = 1; rev <= kMaxReports + 2; ++rev) log.keep(report_of(rev));
    EXPECT_EQ(log.find(1)->scene_rev(), 3u);
    EXPECT_EQ(log.find(kMaxReports + 2)->scene_rev(), kMaxReports + 2);
}

TEST(ReportLogTest, AFrameAnswersWhoWaitsForItOrAnEarlierOne) {
    ReportLog log;
    for (const std::uint32_t rev : {4u, 6u, 5u}) log.wait(query_of(rev), rev);
    EXPECT_TRUE(log.take_answered(3).empty());
    const std::vector<Work> answered = log.take_answered(5);
    ASSERT_EQ(answered.size(), 2u);
    EXPECT_EQ(answered[0].session, 4u) << "in the order in which they came";
    EXPECT_EQ(answered[1].session, 5u);
    EXPECT_TRUE(log.waited_for());
    log.forget_session(6);
    EXPECT_FALSE(log.waited_for());
}

TEST(ReportLogTest, IsFullAtItsBound) {
    ReportLog log;
    for (std::size_t i = 0; i < kMaxReportQueries; ++i) {
        EXPECT_FALSE(log.full());
        log.wait(query_of(1), 1);
    }
    EXPECT_TRUE(log.full());
}

}  // namespace
}  // namespace gonio
