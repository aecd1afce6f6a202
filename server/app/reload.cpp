#include "server/app/reload.h"

#include <mutex>
#include <system_error>
#include <thread>

#include <spdlog/spdlog.h>

#include "server/app/http_options.h"
#include "server/app/log.h"
#include "server/http/tls.h"

namespace gonio {

Reread read_again(const Options& options) {
    Reread now;
    int ignored = 0;
    if (const auto again = parse_options(options.arguments, ignored))
        now.log_level = again->log_level;
    else
        now.kept.push_back({"the log level", "The options are wrong now."});
    if (const auto tokens = read_tokens(options, &now.warning))
        now.tokens = *tokens;
    else
        now.kept.push_back({"the tokens", tokens.error().text()});
    if (options.tls_certificate.empty()) return now;
    if (auto tls = load_tls(options.tls_certificate, options.tls_key))
        now.tls = std::move(*tls);
    else
        now.kept.push_back({"the certificate", tls.error().text()});
    return now;
}

void use_again(const Reread& reread, HttpServer& http_server) {
    if (reread.log_level) set_log_level(*reread.log_level);
    if (reread.tokens) http_server.set_tokens(*reread.tokens);
    if (reread.tls) http_server.set_tls(reread.tls);
    if (!reread.warning.empty()) spdlog::warn("{}", reread.warning);
    std::string names;
    for (const Reread::Kept& kept : reread.kept) {
        spdlog::error("reload: {}: {}", kept.what, kept.why);
        names += (names.empty() ? "" : ", ") + kept.what;
    }
    if (names.empty())
        spdlog::info("reloaded");
    else
        spdlog::warn("reload: not everything can be used; as before: {}", names);
}

struct Reloading::Shared {
    explicit Shared(std::function<Reread()> from) : read(std::move(from)) {}
    const std::function<Reread()> read;
    std::mutex mutex;  // of what follows; never held while files are read
    std::function<void(const Reread&)> use;
    bool wanted = false, running = false;
};

Reloading::Reloading(std::function<Reread()> read) : shared_(std::make_shared<Shared>(std::move(read))) {}

Reloading::~Reloading() {
    end();
}

void Reloading::ask() {
    const std::lock_guard lock(shared_->mutex);
    shared_->wanted = true;
    start(shared_);
}

void Reloading::begin(std::function<void(const Reread&)> use) {
    const std::lock_guard lock(shared_->mutex);
    shared_->use = std::move(use);
    start(shared_);
}

void Reloading::end() {
    const std::lock_guard lock(shared_->mutex);
    shared_->use = nullptr;
}

// Under the mutex.
void Reloading::start(const std::shared_ptr<Shared>& shared) {
    if (!shared->wanted || !shared->use || shared->running) return;
    try {
        std::thread([shared] { work(shared); }).detach();
        shared->running = true;
    } catch (const std::system_error& error) {
        spdlog::error("reload: there is no thread for it: {}", error.what());
    }
}

void Reloading::work(const std::shared_ptr<Shared>& shared) {
    std::unique_lock lock(shared->mutex);
    while (shared->wanted && shared->use) {
        shared->wanted = false;
        lock.unlock();
        const Reread reread = shared->read();
        lock.lock();
        if (shared->use) shared->use(reread);
    }
    shared->running = false;
}

}  // namespace gonio
