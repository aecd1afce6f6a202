#include "server/session/isolux.h"

#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/false_color.h"
#include "server/scene/scene.h"
#include "server/session/legend.h"

namespace gonio {

// The marks are those that shaders made of float values; to find places among them is the loader's.
void answer_isolux(const Work& work, const Scene& scene, Revision rendered, GuardedRenderer& renderer, Loader& loader,
                   Replies& replies) {
    v1::ServerMessage answer;
    answer.mutable_isolux()->set_scene_rev(rendered);
    const bool lines = is_false_color(scene.view) && false_color_of(scene, scene.view).isolux;
    if (!lines || rendered != scene.scene_rev) return replies.answer(work, std::move(answer));
    auto picture = std::make_shared<CapturedPicture>();
    if (!renderer.draws([&] { *picture = renderer->live_picture(); })) return replies.busy(work, "the GPU was lost");
    answer.set_request_id(work.message.request_id());
    const bool accepted = loader.submit(
        [session = work.session, answer = std::move(answer), picture, scene, send = replies.sender()]() mutable {
            for (const LineFigure& one : line_figures(*picture, scene, scene.view)) {
                v1::IsoluxFigure& figure = *answer.mutable_isolux()->add_figures();
                figure.set_value(one.value);
                figure.set_x((one.x + 0.5) / picture->width_px);
                figure.set_y((one.y + 0.5) / picture->height_px);
            }
            send(session, std::move(answer));
        });
    if (!accepted) replies.busy(work, "too many pictures are waiting");
}

}  // namespace gonio
