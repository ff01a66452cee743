# make install      PREFIX=/usr/local [LIBDIR=$PREFIX/lib] [INCLUDEDIR=$PREFIX/include] [DESTDIR=]: libraries, headers, sinew.pc and
#                   the CMake package; everything in it is found from where it lies, so that the tree may be moved
# make uninstall    with the same values: takes away just that

PREFIX ?= /usr/local
LIBDIR ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
INSTALL ?= install

FULL_VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' ../Cargo.toml | head -n 1)
DESCRIPTION := $(shell sed -n 's/^description = "\(.*\)"/\1/p' ../Cargo.toml | head -n 1)
FULL_NAME := $(subst $(VERSION),$(FULL_VERSION),$(SONAME))
PKGCONFIG_FILES := sinew.pc sinew-static.pc
CMAKE_FILES := sinewConfig.cmake sinewConfigVersion.cmake

# From the folder of the libraries to the headers; nothing where one of them is not within PREFIX. By the shell, as folders may have spaces in their names.
INCLUDE_FROM_LIB = $(shell lib='$(LIBDIR)' include='$(INCLUDEDIR)'; lib=$${lib#'$(PREFIX)'/} include=$${include#'$(PREFIX)'/}; \
  test "$$lib" = '$(LIBDIR)' || test "$$include" = '$(INCLUDEDIR)' || echo "$$(echo "$$lib" | sed 's|[^/][^/]*|..|g')/$$include")

FILL = sed -e 's|@VERSION@|$(FULL_VERSION)|g' -e 's|@ABI@|$(VERSION)|g' -e 's|@DESCRIPTION@|$(DESCRIPTION)|g' \
  -e 's|@INCLUDE@|$(INCLUDE_FROM_LIB)|g' -e 's|@NATIVE@|$(NATIVE)|g' -e 's|@SHARED@|$(FULL_NAME)|g' -e 's|@SONAME@|$(SONAME)|g'

install: library
ifneq ($(EXE),)
	$(error on Windows take sinew.dll, libsinew.dll.a and include/ from where they are: there is no package for it)
endif
ifeq ($(INCLUDE_FROM_LIB),)
	$(error LIBDIR and INCLUDEDIR must lie within PREFIX: the package finds its parts from one another)
endif
	$(INSTALL) -d '$(DESTDIR)$(INCLUDEDIR)/sinew' '$(DESTDIR)$(LIBDIR)/pkgconfig' '$(DESTDIR)$(LIBDIR)/cmake/sinew'
	$(INSTALL) -m 644 $(wildcard ../include/sinew.h*) '$(DESTDIR)$(INCLUDEDIR)'
	$(INSTALL) -m 644 $(wildcard ../include/sinew/*.h) '$(DESTDIR)$(INCLUDEDIR)/sinew'
	$(INSTALL) -m 644 $(TARGET)/release/libsinew.a '$(DESTDIR)$(LIBDIR)'
	$(INSTALL) -m 755 $(TARGET)/release/$(SHARED) '$(DESTDIR)$(LIBDIR)/$(FULL_NAME)'
	ln -sf $(FULL_NAME) '$(DESTDIR)$(LIBDIR)/$(SONAME)'
	ln -sf $(SONAME) '$(DESTDIR)$(LIBDIR)/$(SHARED)'
	for file in $(PKGCONFIG_FILES); do $(FILL) ../packaging/$$file.in > '$(DESTDIR)$(LIBDIR)'/pkgconfig/$$file || exit 1; done
	for file in $(CMAKE_FILES); do $(FILL) ../packaging/$$file.in > '$(DESTDIR)$(LIBDIR)'/cmake/sinew/$$file || exit 1; done

uninstall:
	cd '$(DESTDIR)$(INCLUDEDIR)' && rm -f sinew.h sinew.hpp $(patsubst ../include/%,%,$(wildcard ../include/sinew/*.h))
	rmdir '$(DESTDIR)$(INCLUDEDIR)/sinew' 2>/dev/null || true
	cd '$(DESTDIR)$(LIBDIR)' && rm -f libsinew.a $(SHARED) $(SONAME) $(FULL_NAME) \
	  $(PKGCONFIG_FILES:%=pkgconfig/%) $(CMAKE_FILES:%=cmake/sinew/%)
	rmdir '$(DESTDIR)$(LIBDIR)/cmake/sinew' 2>/dev/null || true

.PHONY: install uninstall
