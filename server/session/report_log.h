// Frame reports that are kept for `report --rev`, and who waits for one. Pure.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "protocol/schema/report.pb.h"
#include "server/session/work.h"

namespace gonio {

inline constexpr std::size_t kMaxReports = 256;
inline constexpr std::size_t kMaxReportQueries = 64;  // that wait for their frame; beyond it: "busy"

class ReportLog {
public:
    // Result: the report of the first frame of this revision or a later one; null where none is kept.
    const v1::FrameReport* find(std::uint32_t rev) const;
    // The query waits for a frame of this revision or a later one; not where full().
    void wait(Work query, std::uint32_t rev) { waiting_.push_back({std::move(query), rev}); }
    bool full() const { return waiting_.size() >= kMaxReportQueries; }
    bool waited_for() const { return !waiting_.empty(); }
    // Result: the queries that a frame of this revision answers; they wait no more.
    std::vector<Work> take_answered(std::uint32_t rev);
    // Of several frames of one revision the first is kept: it is the one that shows what the change cost.
    void keep(v1::FrameReport report);
    void forget_session(std::uint32_t session);
    // Of all frames: their revisions count no more.
    void forget() { reports_.clear(); }

private:
    struct Waiting {
        Work query;
        std::uint32_t rev;
    };
    std::deque<v1::FrameReport> reports_;
    std::vector<Waiting> waiting_;
};

}  // namespace gonio
