#include "client/cli/control.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "protocol/schema/words.h"

namespace gonio {
namespace {

constexpr std::chrono::duration<double> kRenew(10.0);  // the lease ends 30 s after its last renewal

std::optional<Error> refusal_of(Connection& connection, const v1::ClientMessage& message) {
    const auto answer = connection.ask(message, [](const v1::Progress&) {});
    if (!answer) return answer.error();
    const v1::Result& result = answer->result();
    if (result.code() == "ok") return std::nullopt;
    return Error{result.code(), result.field(), result.value(), result.message()};
}

v1::ClientMessage acquisition(bool take) {
    v1::ClientMessage message;
    message.mutable_acquire_control()->set_take(take);
    return message;
}

}  // namespace

std::optional<Error> run_control(const ServerAddress& address, const Connection::Wanted& wanted, const ReadWords& words,
                                 std::ostream& out) {
    const bool releases = words.command->name == "control release";
    const bool take = words.has("--take");
    double hold_s = 1e9;
    if (words.has("--hold")) {
        const std::string& text = words.options.at("--hold");
        hold_s = *parse_number(text);
        if (!(hold_s >= 0 && hold_s <= 1e6)) return Error{"usage", "--hold", text, "This must be 0 to 1e6 seconds."};
    }
    auto connection = Connection::open(address, wanted);
    if (!connection) return connection.error();
    if (auto refused = refusal_of(**connection, acquisition(take))) return refused;
    if (!releases) {
        out << "the camera is yours" << std::endl;
        std::chrono::duration<double> left(hold_s);
        while (left.count() > 0) {
            const auto step = std::min(left, kRenew);
            std::this_thread::sleep_for(step);
            left -= step;
            if (auto refused = refusal_of(**connection, acquisition(false))) return refused;
        }
    }
    v1::ClientMessage release;
    release.mutable_release_control();
    if (auto refused = refusal_of(**connection, release)) return refused;
    if (releases) out << "the camera is free" << std::endl;
    return std::nullopt;
}

}  // namespace gonio
