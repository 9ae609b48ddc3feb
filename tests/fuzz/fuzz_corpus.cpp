// Writes the seeds of every fuzz target into FOLDER/NAME/: fuzz_corpus FOLDER.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "common/ivm/ivm_file.h"
#include "common/ivm/refinement.h"
#include "common/ivm/value_file.h"
#include "common/selection/stream_plan.h"
#include "protocol/codec.h"
#include "tests/fuzz/small_volumes.h"
#include "tests/support/batches.h"
#include "tests/support/volume_files.h"

using namespace intervale;

namespace {

class Corpus {
 public:
  explicit Corpus(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void add(const std::string& target, const std::string& name, const std::string& prefix, std::string_view bytes) const {
    std::filesystem::create_directories(folder_ / target);
    std::ofstream(folder_ / target / name, std::ios::binary) << prefix << bytes;
  }
  template <class T>
  void add(const std::string& target, const std::string& name, const std::string& prefix, const std::vector<T>& bytes) const {
    add(target, name, prefix, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }

 private:
  std::filesystem::path folder_;
};

void add_batches(const Corpus& corpus) {
  for (std::size_t i = 0; i < testing::small_volumes().size(); ++i) {
    const IntervalVolume& v = testing::small_volumes()[i];
    const auto queue = in_order(v, select(v, {}), {});
    for (const std::size_t stage : {0u, 5u, 7u}) {
      const auto before = std::span(queue).first(queue.size() * stage / 8), left = std::span(queue).subspan(before.size());
      const auto bytes = testing::batch_of(v, left.first(std::min<std::size_t>(left.size(), 60)), before);
      const std::string name = "volume" + std::to_string(i) + "-stage" + std::to_string(stage);
      corpus.add("update_batch", name, {char(i), char(stage)}, bytes);
      if (stage == 5) corpus.add("update_batch", name + "-budget", {char(i), char(0xb8 | stage)}, bytes);
    }
  }
}

// What a client of all updates, and one of some, gets when it switches both channels on.
void add_channels(const Corpus& corpus) {
  const auto volume = std::make_shared<const IntervalVolume>(testing::small_volumes()[1]);
  for (const bool all : {false, true}) {
    StreamPlan plan(volume);
    Lod lod;
    lod.error = all ? 0 : volume->description().max_error / 2;
    plan.set_lod(lod);
    while (plan.next(1 << 16)) {
    }
    const std::vector<std::size_t> both{0, 1};
    plan.set_channels(both);
    const auto batch = plan.next(1 << 16);
    if (batch) corpus.add("channel_batch", all ? "all" : "some", {7}, batch->channels);
  }
}

void add_volume_files(const Corpus& corpus) {
  const std::string sizes = "dimension: 3\nsizes: 2 3 4\n", samples(24, 'x');
  corpus.add("volume_file", "raw", "NRRD0004\n# made\ntype: uchar\n" + sizes + "encoding: raw\n\n", samples);
  corpus.add("volume_file", "big", "NRRD0004\ntype: unsigned short\nendian: big\nspacings: 1 2 0.5\n" + sizes + "encoding: raw\n\n",
             samples + samples);
  corpus.add("volume_file", "directions",
             "NRRD0005\ntype: int8\nspace: left-posterior-superior\nspace directions: (1,0.5,0) (0,-2,0) (0,0,3)\nspace origin: (1,2,3)\n"
             "space units: \"mm\" \"mm\" \"mm\"\nsample units: HU\ncontent: head\nbyte skip: -1\n" +
                 sizes + "encoding: raw\n\n",
             "head" + samples);
  corpus.add("volume_file", "vectors", "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 3 2 2 2\nkinds: vector domain domain domain\nencoding: raw\n\n",
             samples);
  corpus.add("volume_file", "text", "NRRD0002\ntype: float\n" + sizes + "line skip: 1\nencoding: ascii\n\nskipped\n",
             "1 2 3 4 5 6 7 8 9 10 11 12 1e3 -2 0.5 4 5 6 7 8 9 10 11 12\n");
  corpus.add("volume_file", "detached", "NRRD0004\ntype: uchar\n" + sizes + "encoding: raw\ndata file: elsewhere.raw\n", "");
  corpus.add("volume_file", "gzip", "NRRD0004\ntype: uchar\n" + sizes + "encoding: gzip\n\n", testing::deflated(samples, testing::Wrapping::gzip));
  for (const testing::VolumeFile& file : testing::volume_files()) corpus.add("volume_file", file.name, "", file.bytes);
}

void add_messages(const Corpus& corpus) {
  using namespace protocol;
  corpus.add("protocol", "open", {0}, encode(ClientMessage(Open{"buckyball", "fuzz 1", 262144})));
  corpus.add("protocol", "open-older", {0}, encode(ClientMessage(Open{.dataset = "buckyball", .client = {}, .payload = 0})));
  corpus.add("protocol", "view", {0}, encode(ClientMessage(View{7, {0.5, 10.0, Box{{-1, 0, 1}, {2, 0, 3}}, Camera{.eye = {9, 9, 9}}, 5, 6}})));
  corpus.add("protocol", "view-coarse", {0}, encode(ClientMessage(View{.epoch = 8, .lod = {}, .early = true, .coarse_error_percent = 10})));
  corpus.add("protocol", "view-all", {0}, encode(ClientMessage(View{1, {}})));
  corpus.add("protocol", "view-forget", {0},
             encode(ClientMessage(View{9, {}, 1000, {{{}, {}, supercube_key(3, {1, 2, 0}), 5}, {{}, {}, supercube_key(2, {3, 3, 1}), 129}}})));
  corpus.add("protocol", "view-channels", {0}, encode(ClientMessage(View{10, {}, {}, {}, {}, true, {}, {"noise", "place"}})));
  View moving{.epoch = 11, .lod = {}, .ahead = Camera{.eye = {9, 8, 9}}};
  moving.lod.camera = Camera{.eye = {9, 9, 9}};
  corpus.add("protocol", "view-ahead", {0}, encode(ClientMessage(moving)));
  corpus.add("protocol", "have-channel", {0}, encode(ClientMessage(Have{{{{}, {}, supercube_key(3, {1, 2, 0}), 5}}, 1})));
  corpus.add("protocol", "have", {0},
             encode(ClientMessage(Have{{{{}, {}, supercube_key(3, {1, 2, 0}), 5}, {{}, {}, supercube_key(2, {3, 3, 1}), 129}}})));
  corpus.add("protocol", "credit", {0}, encode(ClientMessage(Credit{65536})));
  corpus.add("protocol", "opened", {1}, encode(ServerMessage(Opened{testing::small_volumes()[1].description(), {}})));
  corpus.add("protocol", "opened-older", {1}, encode(ServerMessage(Opened{testing::small_volumes()[1].description(), {}, true, 1})));
  const IntervalVolume& v = testing::small_volumes()[0];
  const auto queue = in_order(v, select(v, {}), {});
  const auto payload = testing::batch_of(v, std::span(queue).first(30));
  corpus.add("protocol", "batch", {1}, encode(ServerMessage(protocol::Batch{1, 2, 30, 0.5, 2.5, 400, payload})));
  corpus.add("protocol", "batch-channels", {1}, encode(ServerMessage(protocol::Batch{1, 2, 0, 0.5, 2.5, 400, {}, payload})));
  corpus.add("protocol", "done", {1}, encode(ServerMessage(Done{1, 22})));
  corpus.add("protocol", "fault", {1}, encode(ServerMessage(Fault{CloseCode::too_large, "too large"})));
}

// Two bytes of flags: see fuzz_http.cpp.
void add_requests(const Corpus& corpus) {
  const std::string plain{0, 0}, everything{0, 12}, some{0, 8};
  corpus.add("http", "front", plain, "/\nlocalhost:8080\n\n\n");
  corpus.add("http", "url", plain, "http://example.org:8080/lone.gz?x\na\n\n\n");
  corpus.add("http", "url-bare", everything, "HTTPS://[::1]\na\n\n\n");
  corpus.add("http", "packed", plain, "/assets/index-BVx3_a9Z.js?v=1\n[::1]:8080\nbr;q=1, gzip;q=0.8, *;q=0\n\n");
  corpus.add("http", "tag", plain, "/%69ndex.html\na\nx-gzip\n\"0\", W/\"1\"");
  corpus.add("http", "any-tag", plain, "/lone.gz\na; script-src *\n*\n*");
  corpus.add("http", "escapes", {0, 1}, "/assets/50%25%20more%20%26%20less.txt\n\nidentity;q=0, *;q=0.5\n");
  corpus.add("http", "outside", plain, "/%2e%2e/secret\n");
  corpus.add("http", "hidden", plain, "/assets/../.hidden/secret\n");
  corpus.add("http", "unreadable", plain, "/%4\n");
  corpus.add("http", "datasets", everything, "/api/datasets\n\n\n\nen\"gine <1>");
  corpus.add("http", "dataset", everything, "/api/datasets/scans-%C3%A9\n\n\n\n");
  corpus.add("http", "datasets-some", some, "/api/datasets\n\n\n\nscans-\xc3\xa9");
  corpus.add("http", "datasets-none", {1, 4}, "/\n\n\n\nnothing");
  corpus.add("http", "page", {1, 12}, "/\n\n\n\na&b");
  corpus.add("http", "metrics", everything, "/metrics\n\n\n\nengine");
  corpus.add("http", "metrics-door", {6, 0}, "/metrics\n");
  corpus.add("http", "ready", {8, 2}, "/readyz\n");
  corpus.add("http", "healthy", {16, 0}, "/healthz\n");
}

// A byte of what it is: see fuzz_access.cpp.
void add_accesses(const Corpus& corpus) {
  corpus.add("access", "tokens", {0}, "# who may come in\n\nall-0123456789 *\n some.one~/+=\tengine  scans-* h?ad\r\nthird\n");
  corpus.add("access", "tokens-twice", {0}, "hush\nhush x\n");
  corpus.add("access", "tokens-wrong", {0}, "hush\nhush!\n");
  corpus.add("access", "pattern", {1}, "a*b?c**d\naxxbbxcabycd");
  corpus.add("access", "header", {2}, "Bearer abc.def\nintervale.v1");
  corpus.add("access", "subprotocol", {2}, "Basic YWJj\nintervale.v1, intervale.token.YWJjLn5-Lw");
  corpus.add("access", "origin", {3}, "https://Example.org:8080\nexample.ORG:8080\nnull");
  corpus.add("access", "origin-listed", {3}, "http://b:1\na\nhttp://b:1");
  corpus.add("access", "url", {4}, "ws://localhost:8080/bucky ball.2/");
  corpus.add("access", "url-escapes", {4}, "ws://a:1/50%25%%2g%");
  corpus.add("access", "url-6", {4}, "wss://[fe80::1%eth0]:9/x");
  corpus.add("access", "url-bare", {4}, "ws://a-b_c.example");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: fuzz_corpus FOLDER\n", stderr);
    return 2;
  }
  const Corpus corpus(argv[1]);
  for (std::size_t i = 0; i < testing::small_volumes().size(); ++i) {
    corpus.add("ivm_file", "volume" + std::to_string(i), "", encode_ivm(testing::small_volumes()[i]));
    corpus.add("value_file", "volume" + std::to_string(i), "", encode_values(testing::small_value_volumes()[i]));
  }
  add_batches(corpus);
  add_channels(corpus);
  add_volume_files(corpus);
  add_messages(corpus);
  add_requests(corpus);
  add_accesses(corpus);
  return 0;
}
