#include <algorithm>
#include <chrono>
#include <thread>

#include "client/cli/cli.h"
#include "client/cli/commands.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/words.h"

namespace gonio {
namespace {

constexpr std::chrono::duration<double> kRenew(10.0);  // the lease ends 30 s after its last renewal

v1::ClientMessage acquisition(bool take) {
    v1::ClientMessage message;
    message.mutable_acquire_control()->set_take(take);
    return message;
}

}  // namespace

int control(const Session& session, const ReadWords& words) {
    const bool releases = words.command->name == "control release";
    double hold_s = 1e9;
    if (words.has("--hold")) {
        const std::string& text = words.options.at("--hold");
        hold_s = *parse_number(text);
        if (!(hold_s >= 0 && hold_s <= 1e6))
            return session.fail({"usage", "--hold", text, "This must be 0 to 1e6 seconds."});
    }
    auto connection = Connection::open(session.address, {session.token, false, false, session.role});
    if (!connection) return session.fail(connection.error());
    const auto ask = [&](const v1::ClientMessage& message) {
        return (*connection)->ask(message, [](const v1::Progress&) {});
    };
    const auto tell = [&](const char* text) {  // scripts go by the exit code
        if (!session.json) session.out << text << std::endl;
    };
    if (const auto answer = ask(acquisition(words.has("--take"))); !answer) return session.fail(answer.error());
    if (!releases) {
        tell("the camera is yours");
        std::chrono::duration<double> left(hold_s);
        while (left.count() > 0) {
            const auto step = std::min(left, kRenew);
            std::this_thread::sleep_for(step);
            left -= step;
            if (const auto answer = ask(acquisition(false)); !answer) return session.fail(answer.error());
        }
    }
    v1::ClientMessage release;
    release.mutable_release_control();
    if (const auto answer = ask(release); !answer) return session.fail(answer.error());
    if (releases) tell("the camera is free");
    return kExitOk;
}

}  // namespace gonio
