# make engines    the library in other engines, one after another: runs those that are installed, and leaves pictures in target/pictures/
# make love, mono, bullet, godot    one of them; Debian's packages are named beside it below

ENGINES := love mono bullet godot
ENGINE_BUILD := $(BUILD)/engines
ENGINE_LINK := $(LIBRARY) '-Wl,-rpath,$(abspath $(BUILD))' -lm
# A display where there is none.
DISPLAYED := $(if $(DISPLAY),,xvfb-run -a -s '-screen 0 1280x1024x24')

engine_folders: | $(BUILD)/$(SONAME)
	mkdir -p $(ENGINE_BUILD)/home $(PICTURES)

# Missing engines are reported, and the others go on.
engines: engine_folders
	@failed=; for engine in $(ENGINES); do echo; echo "== $$engine"; $(MAKE) --no-print-directory $$engine || failed="$$failed $$engine"; done; \
	  test -z "$$failed" || { echo "not run:$$failed"; exit 1; }

# love, xvfb, xauth
love: engine_folders
	$(DISPLAYED) env XDG_DATA_HOME=$(abspath $(ENGINE_BUILD)/home) \
	  love engines/love $(abspath ../include/sinew/sinew_all.h $(LIBRARY)) $(abspath $(PICTURES))/love.png 100

# mono-mcs, mono-runtime
mono: engine_folders
	mcs -unsafe -warnaserror -out:$(ENGINE_BUILD)/sinew.exe engines/mono/Program.cs ../bindings/csharp/Sinew.cs
	LD_LIBRARY_PATH=$(abspath $(TARGET))/release mono $(ENGINE_BUILD)/sinew.exe $(PICTURES)/mono.png

# libbullet-dev, pkg-config
bullet: engine_folders
	$(CXX) -std=c++17 $(WARNINGS) $(CXXFLAGS) -I../include $$(pkg-config --cflags bullet | sed 's/-I/-isystem/g') \
	  engines/bullet/sheet.cpp -o $(ENGINE_BUILD)/sheet $$(pkg-config --libs bullet) $(ENGINE_LINK)
	$(ENGINE_BUILD)/sheet $(PICTURES)/bullet.png

# godot3-runner, libgl1-mesa-dri, xvfb, xauth; or godot3-server alone, which needs no display
GODOT ?= $(if $(shell command -v godot3-runner),$(DISPLAYED) godot3-runner --audio-driver Dummy,godot3-server)
godot: engine_folders
	$(CC) -std=c99 $(WARNINGS) $(CFLAGS) -I../include -shared -fPIC engines/godot/soft.c -o $(ENGINE_BUILD)/libsoft.so $(ENGINE_LINK)
	HOME=$(abspath $(ENGINE_BUILD)/home) SINEW_SHIM=$(abspath $(ENGINE_BUILD))/libsoft.so SINEW_PICTURE=$(abspath $(PICTURES))/godot.png \
	  $(GODOT) --path engines/godot

.PHONY: engines engine_folders $(ENGINES)
