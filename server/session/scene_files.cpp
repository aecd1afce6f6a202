#include "server/session/scene_files.h"

#include <new>

#include "protocol/schema/codec.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "server/base/clock.h"
#include "server/exchange/export_left_out.h"
#include "server/exchange/export_mvr.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

struct Format {
    const char* name;
    Result<std::string> (*write)(const Scene&, const exchange::Parts&);
    std::vector<std::string> (*left_out)(const Scene&);
};
constexpr Format kFormats[] = {{"glb", exchange::export_glb, exchange::left_out_of_glb},
                               {"mvr", exchange::export_mvr, exchange::left_out_of_mvr}};

const Format* format_of(const std::string& name) {
    for (const Format& format : kFormats)
        if (name == format.name) return &format;
    return nullptr;
}

Result<std::string> written(const Format& format, const Scene& scene, const exchange::Parts& each) {
    try {
        return format.write(scene, each);
    } catch (const std::bad_alloc&) {
        return Error{"too_large", "save_scene", "", "there is not enough memory for the scene's file"};
    }
}

}  // namespace

bool is_scene_format(const std::string& format) {
    return format_of(format) != nullptr;
}

std::optional<Error> check_scene_file(const v1::CaptureQuery& query) {
    v1::CaptureQuery rest = query;
    rest.clear_format();
    rest.clear_after_rev();
    if (rest.ByteSizeLong() == 0) return std::nullopt;
    return Error{"unsupported", "capture.format", query.format(),
                 "the scene's file is asked for with after_rev alone: it has no view, size or quality"};
}

void SceneFiles::add(const Work& work, const Scene& scene, Replies& replies) {
    if (*unfinished_ >= kMaxSceneFiles) return replies.busy(work, "too many files of the scene are waiting");
    ++*unfinished_;
    const bool accepted =
        writer_.submit([work, scene, send = send_, unfinished = unfinished_, began_ns = monotonic_ns()] {
            const v1::CaptureQuery& query = work.message.capture();
            std::int64_t told_ns = began_ns;
            const auto tell = [&](std::size_t done, std::size_t all) {
                if (monotonic_ns() - told_ns < kTellNs || work.message.request_id() == 0) return;
                told_ns = monotonic_ns();
                v1::Progress progress;
                progress.set_request(work.message.request_id());
                progress.set_unit("parts");
                progress.set_samples(static_cast<std::uint32_t>(done));
                progress.set_total(static_cast<std::uint32_t>(all));
                progress.set_seconds(seconds_between(began_ns, told_ns));
                send(work.session, message_of(&v1::ServerMessage::mutable_progress, std::move(progress)));
            };
            const Format& format = *format_of(query.format());
            auto bytes = written(format, scene, tell);
            v1::ServerMessage message;
            if (bytes) {
                v1::CaptureResult& result = *message.mutable_capture();
                result.set_format(query.format());
                result.set_image(std::move(*bytes));
                result.set_scene_rev(scene.scene_rev);
                for (std::string& line : format.left_out(scene)) result.add_warnings(std::move(line));
            } else {
                *message.mutable_result() = refusal(bytes.error());
            }
            --*unfinished;
            message.set_request_id(work.message.request_id());
            send(work.session, std::move(message));
        });
    if (accepted) return;
    --*unfinished_;
    replies.busy(work, "too many files of the scene are waiting");
}

}  // namespace gonio
