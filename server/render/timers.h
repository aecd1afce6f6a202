// GPU time of passes by timestamps around each, read when the work has left the GPU.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "protocol/schema/report.pb.h"
#include "server/gl/objects.h"

namespace gonio {

struct Timers {
    std::vector<std::pair<std::size_t, std::pair<gl::Query, gl::Query>>> passes;  // row, (before, after)

    static gl::Query stamp() {
        GLuint id = 0;
        glCreateQueries(GL_TIMESTAMP, 1, &id);
        glQueryCounter(id, GL_TIMESTAMP);
        return gl::Query(id);
    }
    void resolve(v1::FrameReport& report) const {
        for (const auto& [row, stamps] : passes) {
            GLuint64 from = 0, to = 0;
            glGetQueryObjectui64v(stamps.first.id(), GL_QUERY_RESULT, &from);
            glGetQueryObjectui64v(stamps.second.id(), GL_QUERY_RESULT, &to);
            report.mutable_passes(static_cast<int>(row))
                ->set_gpu_ms(to > from ? static_cast<double>(to - from) * 1e-6 : 0.0);
        }
    }
};

}  // namespace gonio
