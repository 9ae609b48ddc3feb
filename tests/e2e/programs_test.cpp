// The programs as their users have them: what they print, what they leave, how they end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/library_files.h"
#include "tests/support/peers.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"
#include "tests/support/volume_files.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  return {std::istream_iterator<std::string>(in), {}};
}

TEST(Programs, ListNamesWhatIsServed) {
  ServerProgram server;
  const auto list = json_of(run({client(), "list", server.url(), "--json"}));
  ASSERT_EQ(list.at("datasets").size(), 1u);
  const auto& dataset = list.at("datasets").at(0);
  EXPECT_EQ(dataset.at("name"), "buckyball");
  EXPECT_EQ(dataset.at("dims"), nlohmann::json({65, 65, 65}));
  EXPECT_EQ(dataset.at("range"), nlohmann::json({128.0, 188.0}));
  EXPECT_GT(dataset.at("full").at("tets"), 1000);
  EXPECT_THAT(run({client(), "list", server.url()}).out, HasSubstr("buckyball: 65 x 65 x 65"));
}

TEST(Programs, FetchGivesTheMeshThatExtractGives) {
  ServerProgram server;
  const TempDir folder;
  for (const std::vector<std::string>& lod : std::vector<std::vector<std::string>>{
           {}, {"--error-percent", "20"}, {"--error", "5", "--roi", "0", "0", "0", "20", "20", "64"}, {"--error-percent", "100"}}) {
    std::vector<std::string> extract{program("intervale"), "extract", buckyball(), "--json", "-o", folder / "extract.vtu"};
    extract.insert(extract.end(), lod.begin(), lod.end());
    const auto expected = json_of(run(extract));
    auto more = lod;
    more.insert(more.end(), {"-o", folder / "fetch.vtu"});
    const auto got = fetch_json(more, server.url("buckyball"));
    for (const char* key : {"updates", "vertices", "tets"}) EXPECT_EQ(got.at(key), expected.at(key)) << key;
    EXPECT_NEAR(got.at("volume").get<double>(), expected.at("volume").get<double>(), 1e-9 * expected.at("volume").get<double>());
    EXPECT_GT(got.at("bytes_received"), 0);
    EXPECT_GE(got.at("messages"), 2);
    EXPECT_LE(got.at("seconds_first_mesh"), got.at("seconds"));
    EXPECT_TRUE(std::filesystem::exists(folder / "fetch.vtu"));
  }
}

// The buckyball lies in [-1, 1]^3; from outside, from inside, and with its back to the camera.
TEST(Programs, FetchSeesWhatExtractSees) {
  ServerProgram server;
  const TempDir folder;
  const auto all = json_of(run({program("intervale"), "extract", buckyball(), "--json"}));
  for (const char* view : {"--eye 1.2 0.1 -1.5 --look-at 0 0 0 --pixel-error 8", "--eye 0 0 0 --look-at 0.9 0 0 --viewport 320 200 --pixel-error 2",
                           "--eye -1.5 0 0 --look-at -3 0 0 --up 0 0 1 --fov 60 --viewport 800 600",
                           "--eye 1.2 0.1 -1.5 --look-at 0 0 0 --pixel-error 4 --error-percent 5 --roi -1 -1 -1 0.2 1 1"}) {
    SCOPED_TRACE(view);
    const std::vector<std::string> options = words_of(view);
    std::vector<std::string> extract{program("intervale"), "extract", buckyball(), "--json", "-o", folder / "extract.vtu"};
    extract.insert(extract.end(), options.begin(), options.end());
    const auto expected = json_of(run(extract));
    auto more = options;
    more.insert(more.end(), {"-o", folder / "fetch.vtu"});
    const auto got = fetch_json(more, server.url("buckyball"));
    for (const char* key : {"updates", "vertices", "tets"}) EXPECT_EQ(got.at(key), expected.at(key)) << key;
    EXPECT_NEAR(got.at("volume").get<double>(), expected.at("volume").get<double>(), 1e-9 * expected.at("volume").get<double>());
    EXPECT_TRUE(std::filesystem::exists(folder / "fetch.vtu"));
    EXPECT_GT(got.at("updates"), 0);
    EXPECT_LT(got.at("updates"), all.at("updates"));
  }
}

TEST(Programs, ClientsAtOnceAreIndependent) {
  ServerProgram server;
  const std::string url = server.url("buckyball");
  Process all({client(), "fetch", url, "--json"});
  Process coarse({client(), "fetch", url, "--json", "--error-percent", "30"});
  Process none({client(), "fetch", server.url("other"), "--json"});
  const auto all_mesh = json_of(all.wait());
  const auto coarse_mesh = json_of(coarse.wait());
  EXPECT_EQ(none.wait().status, 1);
  EXPECT_EQ(all_mesh.at("tets"), fetch_json({}, url).at("tets"));
  EXPECT_LT(coarse_mesh.at("updates"), all_mesh.at("updates"));
}

TEST(Programs, BudgetsAreNeverPassed) {
  ServerProgram server;
  const std::string url = server.url("buckyball");
  for (const int budget : {0, 1, 100, 5000}) {
    EXPECT_LE(fetch_json({"--max-updates", std::to_string(budget)}, url).at("updates"), budget);
    EXPECT_LE(fetch_json({"--max-tets", std::to_string(100 * budget)}, url).at("tets"), 100 * budget);
  }
  std::uint64_t updates = 0;
  for (const int budget : {1000, 6000, 10000, 20000, 50000}) {
    const auto got = fetch_json({"--max-bytes", std::to_string(budget)}, url);
    EXPECT_LE(got.at("bytes_received"), budget);
    EXPECT_GE(got.at("updates"), updates);  // more bytes, more mesh
    updates = got.at("updates");
  }
  EXPECT_GT(updates, 0u);
}

TEST(Programs, WrongUsageIsStatus2) {
  expect_complaint(run({client()}), 2, "subcommand");
  expect_complaint(run({client(), "fetch"}), 2, "URL");
  expect_complaint(run({client(), "fetch", "ftp://127.0.0.1:1/x"}), 2, "ws://");
  expect_complaint(run({client(), "list", "http://127.0.0.1:1"}), 2, "ws://");
  expect_complaint(run({client(), "fetch", "ws://127.0.0.1:1"}), 2, "NAME");
  expect_complaint(run({client(), "list", "ws://127.0.0.1:1/x"}), 2, "without");
  expect_complaint(run({client(), "fetch", "ws://127.0.0.1:1/x", "-o", "mesh.xyz"}), 2, ".vtu");
  expect_complaint(run({client(), "fetch", "ws://127.0.0.1:1/x", "--error", "-1"}), 2, "--error");
  expect_complaint(run({client(), "fetch", "ws://127.0.0.1:1/x", "--roi", "1", "0", "0", "0", "1", "1"}), 2, "--roi");
  expect_complaint(run({program("intervale"), "serve", buckyball(), "--listen", "nowhere"}), 2, "address", "intervale: ");
  expect_complaint(run({program("intervale"), "build", "https://127.0.0.1:1/a.nrrd", "-o", "a.ivm"}), 2, "not from URLs", "intervale: ");
  expect_complaint(run({program("intervale"), "build", "a.nrrd", "-o", "a.ivm", "--spacing", "1", "1", "2"}), 2, "describe raw input", "intervale: ");
}

TEST(Programs, ACameraThatMakesNoSenseIsStatus2) {
  struct Wrong {
    std::string options, about;
  };
  const std::string camera = "--eye 0 0 -9 --look-at 1 2 3 ";
  std::vector<Wrong> all{{"--eye 0 0 -9", "--look-at"},
                         {"--look-at 1 2 3", "--eye"},
                         {"--eye 0 0 --look-at 1 2 3", "--eye"},
                         {"--eye 1 2 3 --look-at 1 2 3", "another point"},
                         {"--eye nan 0 0 --look-at 1 2 3", "finite"},
                         {"--eye 0 0 0 --look-at 1 inf 3", "finite"},
                         {"--eye 1 -9 3 --look-at 1 2 3", "up"}};  // which is along y unless said otherwise
  for (const Wrong& wrong : std::vector<Wrong>{{"--up 1 2 12", "up"},
                                               {"--up 0 0 0", "up"},
                                               {"--up nan 1 0", "finite"},
                                               {"--fov 0", "field of view"},
                                               {"--fov 180", "field of view"},
                                               {"--fov nan", "field of view"},
                                               {"--viewport 0 480", "viewport"},
                                               {"--viewport 640 0", "viewport"},
                                               {"--viewport 640", "--viewport"},
                                               {"--pixel-error 0", "pixel error"},
                                               {"--pixel-error -1", "pixel error"},
                                               {"--pixel-error nan", "pixel error"},
                                               {"--pixel-error much", "--pixel-error"}}) {
    all.push_back({camera + wrong.options, wrong.about});
    all.push_back({wrong.options, wrong.options.substr(0, wrong.options.find(' '))});  // without an eye none of them means anything
  }
  for (const Wrong& wrong : all) {
    SCOPED_TRACE(wrong.options);
    const auto options = words_of(wrong.options);
    std::vector<std::string> extract{program("intervale"), "extract", buckyball()}, fetch{client(), "fetch", "ws://127.0.0.1:1/x"};
    extract.insert(extract.end(), options.begin(), options.end());
    fetch.insert(fetch.end(), options.begin(), options.end());
    expect_complaint(run(extract), 2, wrong.about, "intervale: ");
    expect_complaint(run(fetch), 2, wrong.about);
  }
}

TEST(Programs, NobodyThereIsOneLine) {
  expect_complaint(run({client(), "fetch", "ws://127.0.0.1:1/x"}), 1, "cannot connect to 127.0.0.1:1");
  expect_complaint(run({client(), "list", "ws://127.0.0.1:1"}), 1, "cannot connect to 127.0.0.1:1");
}

TEST(Programs, NoSuchDatasetIsOneLine) {
  ServerProgram server;
  const TempDir folder;
  expect_complaint(run({client(), "fetch", server.url("fullerene"), "-o", folder / "x.vtu"}), 1, "no data set 'fullerene'");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Programs, AServerThatIsNotOursIsOneLine) {
  const std::string http = "HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nok";
  const std::string upgrade = "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: x\r\n\r\n";
  for (const std::string& answer : {http, upgrade, std::string("220 mail ready\r\n"), std::string(5000, '\0')}) {
    const Stranger stranger(answer);
    expect_complaint(run({client(), "fetch", stranger.url("x")}), 1, "is not an intervale server");
  }
  for (const std::string& answer : {http, std::string("220 mail ready\r\n")}) {
    const Stranger stranger(answer);
    expect_complaint(run({client(), "list", stranger.url("")}), 1, "is not an intervale server");
  }
  const Stranger silent("");
  expect_complaint(run({client(), "fetch", silent.url("x")}), 1, "no answer from");
}

TEST(Programs, AServerThatTakesNobodySaysWhy) {
  const auto complaint_about = [](const std::string& body) {
    const Stranger stranger("HTTP/1.1 503 Service Unavailable\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    const auto finished = run({client(), "fetch", stranger.url("x"), "--reconnect", "0"});
    EXPECT_EQ(finished.status, 1);
    return finished.err;
  };
  EXPECT_THAT(complaint_about("loading\nmore"), ::testing::EndsWith("accepts no new sessions now: loading\n"));
  EXPECT_THAT(complaint_about("\x1b[2J"), ::testing::EndsWith("accepts no new sessions now: ?[2J\n"));
  EXPECT_THAT(complaint_about(std::string(500, 'x')), ::testing::EndsWith("accepts no new sessions now: " + std::string(80, 'x') + "\n"));
  EXPECT_THAT(complaint_about("<html>busy</html>"), ::testing::EndsWith("accepts no new sessions now\n"));
  EXPECT_THAT(complaint_about(""), ::testing::EndsWith("accepts no new sessions now\n"));
}

TEST(Programs, APortInUseIsOneLine) {
  ServerProgram server;
  const auto second = run({program("intervale"), "serve", buckyball(), "--listen", "127.0.0.1:" + std::to_string(server.port())});
  expect_complaint(second, 1, "in use", "intervale: ");
}

TEST(Programs, AGuardThatIsEmptyInTheEnvironmentIsAnError) {
  for (const char* name : {"INTERVALE_TOKENS", "INTERVALE_TLS_CERT", "INTERVALE_TLS_KEY"}) {
    ::setenv(name, "", 1);
    const auto open = run({program("intervale"), "serve", buckyball(), "--listen", "127.0.0.1:0"});
    ::unsetenv(name);
    expect_complaint(open, 2, std::string(name) + " is set but empty", "intervale: ");
  }
}

TEST(Programs, ServeTakesNoLimitThatIsNone) {
  for (const auto& [option, value] : std::vector<std::pair<std::string, std::string>>{{"--allow-origin", "https://example.org/"},
                                                                                      {"--handshake-time", "nan"},
                                                                                      {"--drain-time", "nan"},
                                                                                      {"--max-memory", "-5"},
                                                                                      {"--max-queued-bytes", "-1"},
                                                                                      {"--threads", "100000"}}) {
    expect_complaint(run({program("intervale"), "serve", buckyball(), "--listen", "127.0.0.1:0", option, value}), 2, option, "intervale: ");
  }
}

TEST(Programs, InfoNamesTheFormatsOfAFileThatIsNoneOfThem) {
  const TempDir folder;
  const auto notes = folder.file("notes.txt", "neither this nor that");
  expect_complaint(run({program("intervale"), "info", notes}), 1, "neither an interval volume (.ivm) nor NRRD, NIfTI,", "intervale: ");
  const auto damaged = folder.file("damaged.ivm", "neither this nor that");
  expect_complaint(run({program("intervale"), "info", damaged}), 1, "not an interval volume file", "intervale: ");
}

TEST(Programs, NamesDoNotReachTheTerminalAsTheyAre) {
  const TempDir folder;
  const std::string path = folder / "red \x1b[31m\xff.ivm";
  std::filesystem::copy_file(buckyball(), path);
  for (const char* command : {"info", "verify"}) {
    const auto told = run({program("intervale"), command, path});
    EXPECT_EQ(told.status, 0);
    EXPECT_THAT(told.out, ::testing::AllOf(HasSubstr("red ?[31m"), Not(HasSubstr("\x1b")))) << command;
    EXPECT_EQ(run({program("intervale"), command, path, "--json"}).status, 0);
  }
  const auto missing = run({program("intervale"), "info", folder / "\x1b[31m.ivm"});
  EXPECT_EQ(missing.status, 1);
  EXPECT_THAT(missing.err, Not(HasSubstr("\x1b")));
}

TEST(Programs, AListThatIsNestedWithoutEndIsOneLine) {
  const std::string deep = std::string(1 << 20, '[') + std::string(1 << 20, ']');
  for (const std::string& body : {deep, "{\"datasets\":[{\"name\":" + deep + "}]}"}) {
    const Stranger stranger("HTTP/1.1 200 OK\r\nServer: intervale\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    expect_complaint(run({client(), "list", stranger.url("")}), 1, "is invalid");
  }
}

TEST(Programs, ADamagedFileIsAnErrorIfNamedAndLeftOutInAFolder) {
  const TempDir folder;
  const auto damaged = folder.file("damaged.ivm", "not an interval volume");
  std::filesystem::copy_file(buckyball(), folder / "good.ivm");
  expect_complaint(run({program("intervale"), "serve", damaged, "--listen", "127.0.0.1:0"}), 1, "damaged.ivm", "intervale: ");
  expect_complaint(run({program("intervale"), "serve", folder / "none.ivm", "--listen", "127.0.0.1:0"}), 1, "none.ivm", "intervale: ");
  expect_complaint(run({program("intervale"), "serve", buckyball(), buckyball(), "--listen", "127.0.0.1:0"}), 1, "two data sets", "intervale: ");
  ServerProgram server(folder.path());
  const auto list = json_of(run({client(), "list", server.url(), "--json"}));
  ASSERT_EQ(list.at("datasets").size(), 1u);
  EXPECT_EQ(list.at("datasets").at(0).at("name"), "good");
}

TEST(Programs, ANameThatIsNoTextIsNoTrouble) {
  const TempDir folder;
  const std::string path = folder / "\xff\xfe.ivm";
  std::filesystem::copy_file(buckyball(), path);
  const auto said = run({program("intervale"), "info", path, "--json"});
  EXPECT_EQ(said.status, 0) << said.err;
  EXPECT_TRUE(nlohmann::json::accept(said.out)) << said.out;
}

TEST(Programs, BuildDoesNotWriteOverWhatItReads) {
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd", link = folder / "link.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "9", "-o", volume}).status, 0);
  std::filesystem::create_symlink(volume, link);
  const std::string before = contents_of(volume);
  for (const std::string& output : {volume, link, (folder / "mesh.vtu").string()}) {
    expect_complaint(run({program("intervale"), "build", volume, "-o", output, "--range", "0", "1"}), 2, output, "intervale: ");
  }
  EXPECT_EQ(contents_of(volume), before);
}

TEST(Programs, InfoSaysWhatIsInAVolumeAndBuildTakesIt) {
  const TempDir folder;
  for (const testing::VolumeFile& file : testing::volume_files()) {
    const std::string path = folder.file(file.name, file.bytes);
    const auto info = json_of(run({program("intervale"), "info", path, "--json"}));
    EXPECT_EQ(info.at("dims"), nlohmann::json(testing::kFileDims)) << file.name;
    EXPECT_EQ(info.at("space"), file.space) << file.name;
    EXPECT_EQ(info.at("time_points"), file.time_points) << file.name;
    EXPECT_THAT(run({program("intervale"), "info", path}).out, HasSubstr("3 x 2 x 4")) << file.name;
    std::vector<std::string> build{program("intervale"), "build", path, "-o", folder / "v.ivm", "--json"};
    if (file.time_points > 1) {
      expect_complaint(run(build), 2, "choose one, 0 to 1, with --time-point", "intervale: ");
      build.insert(build.end(), {"--time-point", std::to_string(file.time_point)});
    }
    const auto built = json_of(run(build));
    EXPECT_EQ(built.at("values"), (nlohmann::json{{"least", -300}, {"greatest", 12}})) << file.name;
  }
  expect_complaint(run({program("intervale"), "info", folder.file("x.nii", "x")}), 1, "is not a NIfTI file", "intervale: ");
}

TEST(Programs, BuildKeepsAPartOfAVolume) {
  const TempDir folder;
  std::string header = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 9 8 7\nspace dimension: 3\nspace directions: none (1,0,0) (0,2,0) (0,0,4)\n";
  header += "space origin: (10,20,30)\nkinds: list domain domain domain\nencoding: raw\n\n";
  for (int i = 0; i < 9 * 8 * 7; ++i) header += {char(i % 50), char(100 + i % 50)};
  const std::string volume = folder.file("v.nrrd", header), out = folder / "v.ivm";
  EXPECT_THAT(run({program("intervale"), "info", volume}).out, HasSubstr("numbers   2: choose one with build --part, 0 to 1\n"));
  std::vector<std::string> build{program("intervale"), "build", volume, "-o", out, "--json", "--channel", "other=" + volume + ":/0"};
  expect_complaint(run(build), 2, "2 numbers a sample: choose one, 0 to 1, with --part", "intervale: ");
  build.insert(build.end(), {"--part", "1", "--crop", "2", "6", "1", "7", "3", "5"});
  const auto built = json_of(run(build));
  EXPECT_EQ(built.at("dims"), nlohmann::json({5, 7, 3}));
  EXPECT_EQ(built.at("origin"), nlohmann::json({12.0, 22.0, 42.0}));
  EXPECT_GE(built.at("values").at("least"), 100);
  EXPECT_LT(built.at("channels").at(0).at("values").at("greatest"), 50);
  build.back() = "7";
  expect_complaint(run(build), 2, "the samples on z go from 0 to 6, and 3 to 7 were chosen", "intervale: ");
}

TEST(Programs, AFolderOfDicomImagesIsLookedAtAndBuilt) {
  if (!std::filesystem::exists(program("read-dicom"))) GTEST_SKIP() << "no read-dicom";
  const TempDir folder;
  std::filesystem::create_directory(folder / "scan");
  for (int k = 0; k < 5; ++k) {
    testing::DicomImage image;
    image.instance = k;
    image.series = k < 3 ? "1.2.3" : "9.8";
    image.position = "0\\0\\" + std::to_string(3 * k);
    image.pixels.assign(6, std::int16_t(k));
    folder.file("scan/" + std::to_string(k), testing::dicom_file(image));
  }
  const std::string scan = folder / "scan", out = folder / "v.ivm";
  const auto info = json_of(run({program("intervale"), "info", scan, "--json"}));
  EXPECT_EQ(info.at("format"), "DICOM");
  EXPECT_EQ(info.at("parts").size(), 2u);
  EXPECT_THAT(run({program("intervale"), "info", scan}).out, HasSubstr("2 series: choose one with build --part; what follows is about the first"));
  const auto unchosen = run({program("intervale"), "build", scan, "-o", out});
  EXPECT_EQ(unchosen.status, 2);
  EXPECT_THAT(unchosen.err, HasSubstr("choose one with --part: 1.2.3 (CT 3 x 2, 3 images), 9.8 (CT 3 x 2, 2 images)"));
  const auto built = json_of(run({program("intervale"), "build", scan, "--series", "9.8", "-o", out, "--json"}));
  EXPECT_EQ(built.at("dims"), (nlohmann::json{3, 2, 2}));
  EXPECT_EQ(built.at("values"), (nlohmann::json{{"least", 3}, {"greatest", 4}}));
}

TEST(Programs, ARangeThatHoldsNothingIsSaid) {
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd";
  ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "9", "-o", volume}).status, 0);
  const auto empty = run({program("intervale"), "build", volume, "-o", folder / "x.ivm", "--range", "1200", "2000"});
  EXPECT_EQ(empty.status, 0);
  EXPECT_THAT(empty.err, HasSubstr("no part of the volume lies in the range; its values are "));
}

TEST(Programs, AMistakeIsNamedWithTheHelpForIt) {
  expect_complaint(run({program("intervale"), "bulid", "x"}), 2, "unknown command 'bulid' (see intervale --help)", "intervale: ");
  expect_complaint(run({program("intervale"), "build", "x", "--rnage"}), 2, "(see intervale build --help)", "intervale: ");
}

}  // namespace
}  // namespace intervale
