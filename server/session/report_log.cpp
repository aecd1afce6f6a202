#include "server/session/report_log.h"

#include <algorithm>

#include "protocol/schema/report.pb.h"

namespace gonio {

const v1::FrameReport* ReportLog::find(std::uint32_t rev) const {
    const auto found =
        std::ranges::find_if(reports_, [rev](const v1::FrameReport& report) { return report.scene_rev() >= rev; });
    return found == reports_.end() ? nullptr : &*found;
}

std::vector<Work> ReportLog::take_answered(std::uint32_t rev) {
    const auto answered =
        std::stable_partition(waiting_.begin(), waiting_.end(), [rev](const Waiting& one) { return one.rev > rev; });
    std::vector<Work> queries;
    for (auto one = answered; one != waiting_.end(); ++one) queries.push_back(std::move(one->query));
    waiting_.erase(answered, waiting_.end());
    return queries;
}

void ReportLog::keep(v1::FrameReport report) {
    if (reports_.empty() || reports_.back().scene_rev() != report.scene_rev()) reports_.push_back(std::move(report));
    if (reports_.size() > kMaxReports) reports_.pop_front();
}

void ReportLog::forget_session(std::uint32_t session) {
    std::erase_if(waiting_, [session](const Waiting& one) { return one.query.session == session; });
}

}  // namespace gonio
